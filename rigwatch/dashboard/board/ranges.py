"""Stable axis ranges: derived from the data so far, growing in round steps when needed.

A range that follows every sample makes noise look like motion; the sensor's full range makes motion
look like noise.
"""

import math

import numpy as np

from rigwatch.wire.arrays import FloatArray

Range = tuple[float, float]
_STEPS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


def nice_above(value: float) -> float:
    """The smallest round figure that is not below `value`, which is positive."""
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in _STEPS if step * decade >= value * (1 - 1e-9))


def symmetric(peak: float) -> Range | None:
    """A round range around zero that holds `peak` with a margin; None if `peak` is 0."""
    if not math.isfinite(peak) or peak <= 0:
        return None
    edge = nice_above(1.1 * peak)
    return -edge, edge


def around_signature(signature: float, low: float, high: float) -> Range | None:
    """A round range that holds zero, thresholds and signature, independent of the estimate.

    Estimates have no physical meaning before a fault and may be huge when the rig hardly moves; the
    plot compares them with thresholds and signature. None if these are unknown.
    """
    if not math.isfinite(signature):
        return None
    reach = max(abs(mark) for mark in (signature, low, high) if math.isfinite(mark))
    if reach <= 0:
        return None
    edge = nice_above(1.5 * reach)
    return -0.5 * edge, edge


def peak(values: FloatArray) -> float:
    """The largest finite magnitude in `values`, 0 if there is none."""
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0
