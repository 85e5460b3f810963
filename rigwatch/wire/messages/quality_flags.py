"""Quality flags of a sample, one byte per channel.

A sample whose byte is zero is good. Any bit of `INVALID` excludes it from every filter and
estimate; the other bits are remarks.
"""

import numpy as np
from numpy.typing import NDArray

GOOD = 0
STALE = 1 << 0
"""Held from an earlier sample because the device did not deliver."""
SATURATED = 1 << 1
"""At a rail of the converter or outside the sensor's range."""
STUCK = 1 << 2
"""The raw code has been constant for longer than with a working sensor."""
NON_FINITE = 1 << 3
"""NaN or infinite."""
SPIKE = 1 << 4
"""A change faster than the sensor can follow."""
RESAMPLED = 1 << 5
"""A remark, not a defect: interpolated from samples with jittered or missing time stamps."""

INVALID = STALE | SATURATED | STUCK | NON_FINITE | SPIKE

NAMES = {
    STALE: "stale",
    SATURATED: "saturated",
    STUCK: "stuck",
    NON_FINITE: "non-finite",
    SPIKE: "spike",
    RESAMPLED: "resampled",
}


def valid(quality: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """True where a sample may enter filters and estimates; same shape as `quality`."""
    good: NDArray[np.bool_] = (quality & INVALID) == 0
    return good


def describe(flags: int) -> str:
    """The names of the set flags; "good" if there is none."""
    return ", ".join(name for bit, name in NAMES.items() if flags & bit) or "good"
