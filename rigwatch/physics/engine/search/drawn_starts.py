"""Random starts of a fit, drawn over the bounds of each parameter.

A nonnegative parameter is drawn log-uniformly, between its bounds if both are known and otherwise
over some decades around its value; others are drawn uniformly.
"""

import numpy as np

from rigwatch.physics.engine.equations import Parameter, System
from rigwatch.wire.arrays import FloatArray

DECADES = 3.0
"""Decades on either side of the value if a bound is missing."""


def drawn_start(system: System, begin: FloatArray, generator: np.random.Generator) -> FloatArray:
    """All parameters, with the free ones drawn at random; shape (n_p,).

    Args:
        system: its parameters have bounds.
        begin: values around which those without bounds are drawn, shape (n_p,).
        generator: of random numbers.
    """
    found = begin.copy()
    for index, (name, parameter) in enumerate(system.parameters.items()):
        if name in system.free:
            found[index] = _drawn(parameter, float(begin[index]), generator)
    return found


def _drawn(p: Parameter, value: float, generator: np.random.Generator) -> float:
    if p.low >= 0:
        centre = max(abs(p.value), p.low, 1e-12) if p.value else max(abs(value), 1.0)
        low = max(p.low, centre * 10**-DECADES)
        high = min(p.high, centre * 10**DECADES)
        return float(np.exp(generator.uniform(np.log(low), np.log(max(high, low)))))
    reach = max(abs(p.value), abs(value), 1.0)
    low, high = max(p.low, p.value - reach), min(p.high, p.value + reach)
    return float(generator.uniform(low, high))
