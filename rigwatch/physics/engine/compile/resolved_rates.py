"""Bounds of parameters within which a recording resolves the model's fastest modes.

Where friction or a coarse encoder hides a winding's inductance, a fit may lower it without limit:
R/L grows until the steps of the integration are just stable. A mode there does not decay, so its
initial state is a free constant of each window, and every simulation takes hundreds of steps a
sample. A mode that decays within a sixteenth of a sample is instantaneous for most recordings.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import sympy
from msgspec import structs

from rigwatch.physics.engine.compile.compiled_system import CompiledSystem
from rigwatch.physics.engine.compile.static_kernel import numpy_function
from rigwatch.physics.engine.compile.step_size import INSTANT, constant_rates, fastest_of
from rigwatch.physics.engine.equations import Parameter, System
from rigwatch.wire.arrays import FloatArray

FASTEST = 4.0 * INSTANT
"""Rate times the time between samples beyond which a fit takes no rate of several free parameters.
Where the noise is below 0.2 % of the signal a recording resolves more than `INSTANT`.
"""
ROUNDING = 1.0 + 1e-9
"""Ratio by which a rate beyond the limit may still grow, so that it is between its own bounds."""
HALVINGS = 60
"""Steps of the search for a bound."""


def resolved(system: System, parameters: FloatArray, spacing: float) -> System:
    """The system with bounds of free parameters that keep its constant rates resolved.

    Only rates that depend on one free parameter set a bound: with two, the bound of one would
    depend on the other, see `resolved_from`. A model that starts beyond the limit is left as it is.

    Args:
        system: the equations.
        parameters: values of all parameters, shape (n_p,).
        spacing: time between samples [s].
    """
    bounded = dict(system.parameters)
    for rate in constant_rates(system):
        names = sorted({str(each) for each in rate.free_symbols} & set(system.free))
        if len(names) == 1:
            (name,) = names
            bounded[name] = _bounded(system, bounded[name], name, rate, parameters, spacing)
    return replace(system, parameters=bounded)


def resolved_from(system: System, parameters: FloatArray, spacing: float) -> System:
    """The system bounded to a part of what its constant rates may still grow by.

    A rate may grow by the same ratio with each of its free parameters, and reaches the limit if
    all of them are at their bounds. A fit that ends there may go on from there. A rate beyond the
    limit does not grow.

    Args:
        system, parameters, spacing: as in `resolved`.
    """
    bounded = dict(system.parameters)
    for rate in constant_rates(system):
        names = sorted({str(each) for each in rate.free_symbols} & set(system.free))
        reached = spacing * fastest_of(system, (rate,), parameters)
        if names and 0.0 < reached < np.inf:
            limit = reached * (max(FASTEST / reached, ROUNDING) ** (1.0 / len(names)))
            for name in names:
                bounded[name] = _bounded(
                    system, bounded[name], name, rate, parameters, spacing, limit
                )
    return replace(system, parameters=bounded)


def rate_limit(compiled: CompiledSystem, parameters: FloatArray, spacing: float) -> float:
    """The fastest rate that a fit takes from these parameters, which may be beyond `FASTEST` [1/s].

    Args:
        compiled: the system.
        parameters: where the fit starts, shape (n_p,).
        spacing: time between samples [s].
    """
    return max(FASTEST / spacing, compiled.fastest(parameters))


def _bounded(  # noqa: PLR0917 -- they belong together
    system: System,
    parameter: Parameter,
    name: str,
    rate: sympy.Expr,
    parameters: FloatArray,
    spacing: float,
    limit: float = INSTANT,
) -> Parameter:
    """A parameter with the bounds at which the rate reaches the limit."""
    function = numpy_function(tuple(system.parameters), (rate,))
    index = list(system.parameters).index(name)

    def too_fast(value: float) -> bool:
        found = function(*np.concatenate([parameters[:index], [value], parameters[index + 1 :]]))[0]
        return not abs(float(found)) * spacing <= limit

    start = float(np.clip(parameters[index], parameter.low, parameter.high))
    if too_fast(start):
        return parameter
    low, high = (
        _edge(too_fast, start, end) if np.isfinite(end) and too_fast(end) else end
        for end in (parameter.low, parameter.high)
    )
    return structs.replace(parameter, low=low, high=high)


def _edge(too_fast: Callable[[float], bool], slow: float, fast: float) -> float:
    """The value next to which the rate is too fast."""
    for _ in range(HALVINGS):
        middle = 0.5 * (slow + fast)
        slow, fast = (slow, middle) if too_fast(middle) else (middle, fast)
    return slow
