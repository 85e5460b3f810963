"""Where between samples the edges of a square wave lie, if its generator has a clock of its own.

Regular edges lie on a line t = a + k·P and are read at the first sample at or after them, so each
bounds the line to one sample. All lines that agree with the last edges are taken as equally likely;
their mean and spread give the newest edge between samples. As long as all intervals are equal this
tells nothing, and nothing is said. Later intervals that differ by a sample narrow it down to a few
percent of one. A generator that updates at the instants of sampling may show the same intervals,
with all edges at samples: only the motion tells which of the two it is (see `edge_choice`).

An edge that is a share x of an interval before its sample acts as two steps at samples, of the same
sum and centre: x·(1 + x)/2 at the sample before, and x·(1 - x)/2 at its own.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.drives.edges import LARGEST, LAST, SHORTEST, edge
from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes, fill_rows, push
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel, part

UNIFORM = np.sqrt(3.0)
"""Ratio of the largest error to the standard deviation, if all errors up to it are as likely."""
COUNT, LEAST = 128, 6
"""Edges of one way that are remembered, and those that must lie on a line."""
SURE = 0.15
"""Standard deviation below which edges are located; they remain so, less well, until the wave ends
or leaves every line [samples].
"""
LINES = 32
"""Periods that are tried, between the shortest and the longest possible one."""
LONGEST = 4.0
"""Time without an edge after which there is no wave [intervals of edges of one way]."""


class Moved(NamedTuple):
    """An input at the samples `half_width` before those given, each of shape (n,).

    Attributes:
        held: the samples themselves.
        gained: what the mean until the next sample gains by edges between samples.
        shows: whether its edges lie on a line that is known.
        unsure: largest error of their instants [samples].
    """

    held: FloatArray
    gained: FloatArray
    shows: BoolArray
    unsure: FloatArray


class SlidingEdges:
    """Follows one input, block by block.

    Args:
        half_width: lag of the results [samples].
    """

    def __init__(self, half_width: int) -> None:
        self._edges = np.zeros((2, COUNT))
        self._ways = np.zeros((2, len(_OWN)))
        self._kept = np.zeros(3)
        self._delayed = np.zeros((2, half_width + 1))

    def update(self, signal: FloatArray, code: Codes) -> Moved:
        """The next samples of the input, shape (n,), with states of the admission."""
        n = code.size
        found = Moved(np.zeros(n), np.zeros(n), np.zeros(n, np.bool_), np.zeros(n))
        _advance(
            np.ascontiguousarray(signal), code, self._edges, self._ways, self._kept, self._delayed,
            *found,
        )  # fmt: skip
        return found


class _Own(NamedTuple):
    """Indices of the carried figures of edges that rise, and of those that fall: their number, age
    of the last, the interval before it, place of the line before the sample, its spread, and
    whether they have been located.
    """

    filled: int = 0
    age: int = 1
    interval: int = 2
    early: int = 3
    spread: int = 4
    located: int = 5


_OWN = _Own()
FILLED, AGE, INTERVAL, EARLY, SPREAD, LOCATED = _OWN
FOLLOWS = LARGEST + 1
"""Carried figure beside those of `edge`: share of the last edge that this sample takes."""
SAMPLE, GAIN = range(2)


@kernel()
def _advance(  # noqa: PLR0917 -- a kernel
    signal: FloatArray,
    code: Codes,
    edges: FloatArray,
    ways: FloatArray,
    kept: FloatArray,
    delayed: FloatArray,
    held: FloatArray,
    gained: FloatArray,
    shows: NDArray[np.bool_],
    unsure: FloatArray,
) -> None:
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            kept[LAST], kept[LARGEST], kept[FOLLOWS] = signal[k], 0.0, 0.0
            fill_rows(delayed, 0.0)
            _forget(ways)
        if code[k] == DEAD:
            continue
        step = edge(signal[k], kept)
        ways[0, AGE] += 1.0
        ways[1, AGE] += 1.0
        push(delayed[SAMPLE], signal[k])
        push(delayed[GAIN], kept[FOLLOWS])
        kept[FOLLOWS] = 0.0
        if step != 0.0:
            if min(ways[0, AGE], ways[1, AGE]) < SHORTEST:
                _forget(ways)
            way = 1 if step > 0.0 else 0
            _edge(edges[way], ways[way])
            if _known(ways):
                follows = _follows(ways[way])
                delayed[GAIN, -1] = (ways[way, EARLY] - follows) * step
                kept[FOLLOWS] = follows * step
        held[k], gained[k], shows[k] = delayed[SAMPLE, 0], delayed[GAIN, 1], _known(ways)
        unsure[k] = max(_unsure(ways[0]), _unsure(ways[1])) if shows[k] else 0.0


@part()
def _forget(ways: FloatArray) -> None:
    fill_rows(ways, 0.0)


@part()
def _known(ways: FloatArray) -> bool:
    """Whether the wave goes on and its edges of both ways are located."""
    for way in range(2):
        goes_on = ways[way, AGE] <= LONGEST * ways[way, INTERVAL]
        if not goes_on or ways[way, LOCATED] <= 0.0:
            return False
    return True


@part()
def _follows(own: FloatArray) -> float:
    """Share of a step that the sample after it takes, so that the steps' centre is the edge's."""
    return 0.5 * own[EARLY] * (1.0 - own[EARLY])


@part()
def _unsure(own: FloatArray) -> float:
    """The largest error of the instant; what two steps leave is less than they differ by."""
    return UNIFORM * own[SPREAD] + _follows(own)


@part()
def _edge(edges: FloatArray, own: FloatArray) -> None:
    """Take an edge of one way, with those before it that lie on a line with it.

    The array holds the times since each, newest last.
    """
    if own[FILLED] > 0.0:
        for i in range(edges.size):
            edges[i] += own[AGE]
        own[INTERVAL] = own[AGE]
    push(edges, 0.0)
    own[FILLED], own[AGE] = min(own[FILLED] + 1.0, float(COUNT)), 0.0
    while own[FILLED] >= LEAST:
        early, spread = _located(edges[COUNT - int(own[FILLED]) :])
        if spread >= 0.0:
            own[EARLY], own[SPREAD] = early, spread
            if spread < SURE:
                own[LOCATED] = 1.0
            return
        own[FILLED] = np.floor(0.5 * own[FILLED])
    own[LOCATED] = 0.0


@part()
def _located(ago: FloatArray) -> tuple[float, float]:
    """How long before its sample the newest edge is, with its spread; below 0 if there is no line.

    Args:
        ago: time since each edge was read, newest last.
    """
    shortest, longest = _periods(ago)
    if longest <= shortest:
        return 0.0, -1.0
    total = first = second = 0.0
    for tried in range(LINES):
        period = shortest + (longest - shortest) * (tried + 0.5) / LINES
        least, most = 0.0, 1.0
        for i in range(ago.size):
            late = (ago.size - 1 - i) * period - ago[i]
            least, most = max(least, -late), min(most, 1.0 - late)
        width = most - least
        if width > 0.0:
            middle = 0.5 * (least + most)
            total += width
            first += width * middle
            second += width * (middle * middle + width * width / 12.0)
    if total == 0.0:
        return 0.0, -1.0
    mean = first / total
    return mean, np.sqrt(max(second / total - mean * mean, 0.0))


@part()
def _periods(ago: FloatArray) -> tuple[float, float]:
    """The shortest and the longest period of a line through the edges."""
    shortest, longest = 0.0, np.inf
    for i in range(ago.size):
        for j in range(i + 1, ago.size):
            between, parts = ago[i] - ago[j], j - i
            shortest = max(shortest, (between - 1.0) / parts)
            longest = min(longest, (between + 1.0) / parts)
    return shortest, longest
