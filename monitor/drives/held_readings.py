"""Whether a generator holds each voltage for several samples, from the input alone.

Its readings then repeat. Where between samples the next update falls shows in none of them, so the
instants of its steps are known to half a sample only.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes, fill
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel

SAME = 0.25
"""Change of a reading, relative to the usual one, below which it repeats."""
OFTEN = 0.4
"""Share of readings that repeat above which the voltage is held: of smooth drives, noise and steps
that jitter it is 0.1 to 0.33.
"""
MEMORY, SLOW = 64.0, 256.0
"""Memory of that share, and of the usual change [samples]."""
LONGEST = 8.0
"""Repeats in a row that count: after more the drive rests [samples]."""
REMEMBERED = 1024.0
"""Samples for which it is taken to do so after it has shown it."""


class HeldReadings:
    """Follows one input, block by block."""

    def __init__(self) -> None:
        self._kept = np.zeros(len(_AT))

    def update(self, signal: FloatArray, code: Codes) -> BoolArray:
        """Whether the voltage is held, shape (n,), with states of the admission."""
        found = np.zeros(code.size, np.bool_)
        _advance(np.ascontiguousarray(signal), code, self._kept, found)
        return found


class _At(NamedTuple):
    """Indices of the carried figures: last reading, mean square of its changes, share of repeats,
    how many in a row, the time since they were often, the last step, and whether the one before it
    was in the same direction.
    """

    last: int = 0
    usual: int = 1
    share: int = 2
    row: int = 3
    ago: int = 4
    step: int = 5
    follows: int = 6


_AT = _At()
LAST, USUAL, SHARE, ROW, AGO, STEP, FOLLOWS = _AT


@kernel()
def _advance(signal: FloatArray, code: Codes, kept: FloatArray, found: NDArray[np.bool_]) -> None:
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            fill(kept, 0.0)
            kept[LAST], kept[AGO] = signal[k], REMEMBERED
        if code[k] == DEAD:
            continue
        step = signal[k] - kept[LAST]
        kept[LAST] = signal[k]
        kept[USUAL] += (step * step - kept[USUAL]) / SLOW
        kept[ROW] += 1.0
        if step * step >= SAME * SAME * kept[USUAL]:
            # The steps of a square wave turn back each time.
            kept[FOLLOWS] = 1.0 if step * kept[STEP] > 0.0 else 0.0
            kept[STEP], kept[ROW] = step, 0.0
        repeats = kept[FOLLOWS] if 0.0 < kept[ROW] <= LONGEST else 0.0
        kept[SHARE] += (repeats - kept[SHARE]) / MEMORY
        kept[AGO] = 0.0 if kept[SHARE] > OFTEN else min(kept[AGO] + 1.0, REMEMBERED)
        found[k] = kept[AGO] < REMEMBERED
