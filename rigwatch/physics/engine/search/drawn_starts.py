"""Where else a fit may begin: values drawn over the bounds of each parameter.

A parameter that cannot be negative is drawn log-uniformly, between its bounds where both are known
and else over some decades around its value; another one is drawn evenly.
"""

import numpy as np

from rigwatch.physics.engine.equations import Parameter, System
from rigwatch.wire.arrays import FloatArray

DECADES = 3.0
"""Powers of ten to both sides of the value where a bound is missing."""


def drawn_start(system: System, begin: FloatArray, generator: np.random.Generator) -> FloatArray:
    """All parameters, the free ones drawn; shape (n_p,).

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
