"""Edges of an input that lost samples hide.

Samples that are missing are held, or interpolated on import. That hardly matters to a smooth input.
The edge of a square wave, though, lay anywhere among them, and what the equations make of another
instant is no fault. An edge is a change across missing samples of half the input's recent range.
"""

import numpy as np
from numpy.typing import NDArray

from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel

EDGE = 0.5
"""Change relative to the recent range that is an edge."""
MEMORY = 256.0
"""Samples in which the recent range shrinks to a signal that has become smaller."""
LAST, LOW, HIGH, BRIDGING = range(4)
"""Carried figures: the last sample of its own, the recent range, and whether samples are missing.
"""


class BridgedEdges:
    """Follows one input, block by block."""

    def __init__(self) -> None:
        self._kept = np.zeros(4)

    def update(self, signal: FloatArray, bridged: BoolArray, code: Codes) -> BoolArray:
        """Whether an edge was hidden by the samples missing just before each, shape (n,).

        Args:
            signal: the input, shape (n,).
            bridged: samples that are held or interpolated, shape (n,).
            code: of each sample.
        """
        found = np.zeros(code.size, np.bool_)
        _advance(np.ascontiguousarray(signal), bridged, code, self._kept, found)
        return found


@kernel()
def _advance(
    signal: FloatArray,
    bridged: NDArray[np.bool_],
    code: Codes,
    kept: FloatArray,
    found: NDArray[np.bool_],
) -> None:
    for k in range(code.size):
        if code[k] == DEAD:
            continue
        if bridged[k]:
            kept[BRIDGING] = 1.0
            continue
        value = signal[k]
        if code[k] == RESTART or code[k] == NEW_BOOT:
            kept[LAST] = kept[LOW] = kept[HIGH] = value
        extent = kept[HIGH] - kept[LOW]
        found[k] = kept[BRIDGING] > 0.0 and abs(value - kept[LAST]) > EDGE * extent
        kept[LOW] = min(value, kept[LOW] + extent / MEMORY)
        kept[HIGH] = max(value, kept[HIGH] - extent / MEMORY)
        kept[LAST], kept[BRIDGING] = value, 0.0
