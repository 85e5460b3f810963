"""The engine's simulation with sensitivities compared with other simulators."""
