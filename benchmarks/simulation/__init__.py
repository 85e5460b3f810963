"""The engine's simulation with sensitivities beside other people's."""
