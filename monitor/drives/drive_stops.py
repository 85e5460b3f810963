"""Drives that stop: an input that stays where it is for longer than it usually does.

A mass that comes to rest moves as it never does under a drive, which is no fault. Squares and held
readings stay as well, and slow tones at their peaks: the longest stay of the last seconds counts.
"""

import numpy as np
from numpy.typing import NDArray

from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel

FLAT = 0.005
"""Change between samples, relative to the recent range, that is none: a loop still drifts."""
SLOW = 0.1
"""The same relative to the recent largest change: below half a hertz a tone changes by less."""
LONGER, LEAST = 1.5, 3.0
"""A stop is a stay longer than the usual one by this factor and this many samples."""
PAUSE, TWICE = 256.0, 2.0
"""A stay is usual from its first time on if it is no longer than this [samples] or than the usual
one by this factor: the half period of a square is, a stop is not.
"""
RANGE_MEMORY, STAY_MEMORY = 256.0, 4096.0
"""Changes in which the recent range, and samples in which the usual stay, become a new drive's."""
LAST, LOW, HIGH, STEEP, STAY, USUAL = range(6)
"""Carried figures: the last sample, the recent range and largest change, how long the input stays,
and usually.
"""


class DriveStops:
    """Follows one input, block by block."""

    def __init__(self) -> None:
        self._kept = np.zeros(6)

    def update(self, signal: FloatArray, code: Codes) -> BoolArray:
        """Where an input of shape (n,) is found to have stopped, shape (n,)."""
        found = np.zeros(code.size, np.bool_)
        _advance(np.ascontiguousarray(signal), code, self._kept, found)
        return found


@kernel()
def _advance(signal: FloatArray, code: Codes, kept: FloatArray, found: NDArray[np.bool_]) -> None:
    for k in range(code.size):
        if code[k] == DEAD:
            continue
        value = signal[k]
        if code[k] == RESTART or code[k] == NEW_BOOT:
            kept[LAST] = kept[LOW] = kept[HIGH] = value
            kept[STEEP] = kept[STAY] = kept[USUAL] = 0.0
        kept[LOW], kept[HIGH] = min(value, kept[LOW]), max(value, kept[HIGH])
        extent = kept[HIGH] - kept[LOW]
        kept[USUAL] -= kept[USUAL] / STAY_MEMORY
        change = abs(value - kept[LAST])
        kept[LAST] = value
        kept[STEEP] = max(kept[STEEP], change)
        moves = change > min(FLAT * extent, SLOW * kept[STEEP])
        if moves:
            longest = max(TWICE * kept[USUAL], PAUSE)
            kept[USUAL] = max(kept[USUAL], min(kept[STAY], longest))
            kept[LOW] = min(value, kept[LOW] + extent / RANGE_MEMORY)
            kept[HIGH] = max(value, kept[HIGH] - extent / RANGE_MEMORY)
            kept[STEEP] -= kept[STEEP] / RANGE_MEMORY
            kept[STAY] = 0.0
            continue
        before, allowed = kept[STAY], LONGER * kept[USUAL] + LEAST
        kept[STAY] += 1.0
        found[k] = before <= allowed < kept[STAY]
