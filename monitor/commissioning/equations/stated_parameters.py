"""Values that a user states for parameters of the equations, such as a mass that was weighed."""

from collections.abc import Mapping

from monitor.observer import base_model
from rigwatch.physics.engine.equations import Parameter
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.units import unit_of


def stated_in_si(name: str, written: Mapping[str, float]) -> dict[str, float]:
    """The values in SI.

    Args:
        name: of a shipped model of equations, or its file.
        written: values by parameter, in the units of the model file.

    Raises:
        ModelError: the model has no such parameter, or a value is out of its bounds.
    """
    known = base_model(name).parameters
    for parameter, value in written.items():
        if parameter not in known:
            raise ModelError(f"{name}: found no parameter {parameter!r}{nearest(parameter, known)}")
        if broken := known[parameter].bounds_broken(value):
            raise ModelError(f"{name}: found {parameter} = {value:g}, expected {broken}")
    return {n: float(unit_of(_unit(known[n])).to_si(value)) for n, value in written.items()}


def units_of_parameters(name: str) -> dict[str, str]:
    """The unit of each parameter of a model of equations, as its file writes them."""
    return {parameter: _unit(known) for parameter, known in base_model(name).parameters.items()}


def _unit(parameter: Parameter) -> str:
    return parameter.shown or parameter.unit
