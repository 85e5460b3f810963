"""Ports of a model: how many effects may enter at each, and variables that none of them uses."""

from rigwatch.physics.engine.equations import Model, library
from rigwatch.physics.engine.score import suits, variables_read


def entering(model: Model) -> dict[str, int]:
    """Number of effects of the library that suit each port, by its name."""
    effects = library().values()
    return {
        name: sum(suits(effect, port, model) for effect in effects)
        for name, port in model.ports.items()
    }


def unread(model: Model) -> tuple[str, ...]:
    """Variables of ports that no effect of the library uses, as "port.variable"."""
    known = variables_known()
    return tuple(
        f"{name}.{variable}"
        for name, port in model.ports.items()
        for variable in port.variables
        if variable not in known
    )


def variables_known() -> frozenset[str]:
    """Variables of ports that effects of the library use."""
    return frozenset().union(*map(variables_read, library().values()))
