"""Whether the instants of a square wave's edges are known, from the input alone.

The edges of a steady wave, read on a grid of samples, come at intervals whose sums over any number
of them differ by one sample at most, whatever the period. If edges coincide with the instants of
sampling and jitter, some are read a sample late, and sums differ by two. An interval that alone
differs from all others comes from such an edge, or from a clock of its own, on which edges slide
over the samples. Where between samples they are cannot be told, as it can be of smooth drives (see
`jittered_steps` and `sliding_steps`): an edge shows nothing of it.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.drives.edges import LARGEST, LAST, SHORTEST, edge
from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes, fill, push
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel, part

COUNT, NEAR = 8, 2.0
"""Intervals that are compared, and difference of two above which the wave is not steady."""
LATE = 2.0
"""Difference of sums that no regular edges have."""
REMEMBERED = 1024.0
"""Samples for which edges are taken to do so after they have shown it."""


class Instants(NamedTuple):
    """The edges of an input, both of shape (n,).

    Attributes:
        unsure: whether they jitter or slide, or have done so lately.
        jitters: whether the last ones jitter.
    """

    unsure: BoolArray
    jitters: BoolArray


class JitteredEdges:
    """Follows one input, block by block."""

    def __init__(self) -> None:
        self._intervals = np.zeros((2, COUNT))
        self._ways = np.zeros((2, 3))
        self._kept = np.zeros(4)

    def update(self, signal: FloatArray, code: Codes) -> Instants:
        """The next samples of the input, shape (n,), with states of the admission."""
        found = Instants(np.zeros(code.size, np.bool_), np.zeros(code.size, np.bool_))
        carried = self._intervals, self._ways, self._kept
        _advance(np.ascontiguousarray(signal), code, *carried, *found)
        return found


AGE, AGO = LARGEST + 1, LARGEST + 2
"""Carried figures beside those of `edge`: samples since the last, and since edges jittered."""
OWN_AGE, FILLED, JITTER = range(3)
"""Carried figures of edges that rise and of those that fall: age of the last, number of intervals,
below 0 without an edge, and whether these jitter.
"""
GOES_ON = 2.0
"""Time without an edge up to which the wave goes on [intervals]."""


@kernel()
def _advance(  # noqa: PLR0917 -- a kernel
    signal: FloatArray,
    code: Codes,
    intervals: FloatArray,
    ways: FloatArray,
    kept: FloatArray,
    unsure: NDArray[np.bool_],
    jitters: NDArray[np.bool_],
) -> None:
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            fill(kept, 0.0)
            kept[LAST] = signal[k]
            kept[AGO] = REMEMBERED
            _forget(ways)
        if code[k] == DEAD:
            continue
        step = edge(signal[k], kept)
        kept[AGE] += 1.0
        ways[0, OWN_AGE] += 1.0
        ways[1, OWN_AGE] += 1.0
        kept[AGO] = min(kept[AGO] + 1.0, REMEMBERED)
        if step != 0.0:
            if kept[AGE] < SHORTEST:
                _forget(ways)
            else:
                way = 1 if step > 0.0 else 0
                _edge(intervals[way], ways[way], kept)
            kept[AGE] = 0.0
        unsure[k] = kept[AGO] < REMEMBERED
        jitters[k] = _still(intervals[0], ways[0]) or _still(intervals[1], ways[1])


@part()
def _forget(ways: FloatArray) -> None:
    ways[0, FILLED] = ways[1, FILLED] = -1.0
    ways[0, JITTER] = ways[1, JITTER] = 0.0


@part()
def _still(intervals: FloatArray, own: FloatArray) -> bool:
    """Whether the last edges of one way jitter, and the wave goes on."""
    return own[JITTER] > 0.0 and own[OWN_AGE] <= GOES_ON * intervals[-1]


@part()
def _edge(intervals: FloatArray, own: FloatArray, kept: FloatArray) -> None:
    """Take an edge, which is compared with others of its way."""
    if own[FILLED] >= 0.0:
        push(intervals, own[OWN_AGE])
    own[FILLED] = min(own[FILLED] + 1.0, float(COUNT))
    own[OWN_AGE] = 0.0
    own[JITTER] = 1.0 if own[FILLED] == COUNT and _jitter(intervals) else 0.0
    if own[JITTER] > 0.0 or (own[FILLED] == COUNT and _lone(intervals)):
        kept[AGO] = 0.0


@part()
def _jitter(intervals: FloatArray) -> bool:
    """Whether the intervals are those of a steady wave but for a sample more or less."""
    if _range(intervals, intervals.size) > NEAR:
        return False
    for length in range(1, intervals.size):
        least, most = np.inf, 0.0
        for first in range(intervals.size - length + 1):
            total = 0.0
            for i in range(first, first + length):
                total += intervals[i]
            least, most = min(least, total), max(most, total)
        if most - least >= LATE:
            return True
    return False


@part()
def _lone(intervals: FloatArray) -> bool:
    """Whether the newest interval differs by a sample from all others, which are equal."""
    newest = intervals.size - 1
    return _range(intervals, newest) == 0.0 and abs(intervals[newest] - intervals[0]) == 1.0


@part()
def _range(intervals: FloatArray, count: int) -> float:
    """Difference of the longest and the shortest of the first `count` intervals."""
    least = most = intervals[0]
    for i in range(1, count):
        least, most = min(least, intervals[i]), max(most, intervals[i])
    return most - least
