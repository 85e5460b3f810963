"""Fits an effect to an observed change: its parameters, and what it leaves.

The first order of an effect ranks small ones; a lag of half a period or a hysteresis as wide as the
motion is far from it (`finite_effects.py`).
"""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import least_squares

from monitor.diagnosis.observed_change import ObservedChange
from rigwatch.physics.engine.equations import Effect, EffectParameter
from rigwatch.physics.engine.score import Candidate, Trajectory, finite_effect
from rigwatch.wire.arrays import FloatArray

STARTS = (1.0, 0.3, 3.0)
"""Multiples of the strength to first order from which a fit starts."""
MOST_EVALUATIONS = 15
"""Evaluations of a fit, without those for differences."""
HOPELESS = 1e6
"""What counts as left where an effect gives no number, in units of the noise."""


def sized(at: Trajectory, candidate: Candidate, strength: float, change: ObservedChange) -> float:
    """Share of the change's energy that a candidate explains with its best parameters.

    Args:
        at: signals at the ports.
        candidate: with values for its shape.
        strength: to first order; the fit keeps its sign.
        change: to be explained.
    """
    added = finite_effect(at, candidate)
    target = change.values.ravel()
    starts = [_first(candidate, multiple * strength, multiple) for multiple in STARTS]
    unit = np.array([abs(value) or 1.0 for value in starts[0].values()])
    low, high = _bounds(candidate, strength)
    fixed = {name: p.value for name, p in candidate.effect.parameters.items()} | candidate.shape
    fixed[candidate.effect.strength] = 1.0  # a switch; another strength is free

    def left(place: FloatArray) -> FloatArray:
        values = fixed | dict(zip(starts[0], (place * unit).tolist(), strict=True))
        with np.errstate(all="ignore"):
            caused = change.caused(candidate.port, added(values)[0])
        found = target - caused.ravel()
        return np.where(np.isfinite(found), found, HOPELESS)

    bounds = low / unit, high / unit
    found = [
        least_squares(left, _within(start, unit, bounds), bounds=bounds, max_nfev=MOST_EVALUATIONS)
        for start in starts
    ]
    best = 2.0 * min(float(one.cost) for one in found)
    return 1.0 - best / max(float(target @ target), 1e-300)


def _free(effect: Effect) -> dict[str, EffectParameter]:
    return {n: p for n, p in effect.parameters.items() if p.role in ("strength", "shape")}


def _first(candidate: Candidate, strength: float, multiple: float) -> dict[str, float]:
    """First values of the free parameters; of an effect that is switched on, its shape scales."""
    free, name = _free(candidate.effect), candidate.effect.strength
    first = {n: candidate.shape.get(n, p.value) for n, p in free.items()}
    if name not in free:
        return {n: multiple * value for n, value in first.items()}
    return first | {name: free[name].neutral + strength}


def _bounds(candidate: Candidate, strength: float) -> tuple[FloatArray, FloatArray]:
    """Bounds of the free parameters; the strength keeps its sign."""
    free, name = _free(candidate.effect), candidate.effect.strength
    low, high = {n: p.low for n, p in free.items()}, {n: p.high for n, p in free.items()}
    if name in free and strength > 0.0:
        low[name] = max(low[name], free[name].neutral)
    elif name in free:
        high[name] = min(high[name], free[name].neutral)
    return np.array(list(low.values())), np.array(list(high.values()))


def _within(
    first: Mapping[str, float], unit: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """A start in units of the parameters, strictly within the bounds, as the solver wants it."""
    low, high = bounds
    room = np.minimum(1e-6, 0.25 * (high - low))
    return np.clip(np.array(list(first.values())) / unit, low + room, high - room)
