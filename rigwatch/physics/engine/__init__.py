"""The physics engine: models as equations, effects as expressions at ports, exact sensitivities."""
