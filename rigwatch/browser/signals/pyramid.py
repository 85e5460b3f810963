"""Extremes of a signal at several resolutions, so that any span is displayed quickly.

A column of a chart looks the same as with all its samples if drawn from four of them: first,
lowest, highest, last (M4: Jugel et al., VLDB 2014, doi 10.14778/2732951.2732953). Each level stores
these for blocks `STEP` times as long as those of the level below.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray

Samples = NDArray[np.float32]
FIRST, LOW, HIGH, LAST = range(4)
STEP = 8
FINEST = 16
"""Samples per block of the finest level."""
LEAST = 64
"""Number of blocks below which no coarser level is created."""


@dataclass(frozen=True, eq=False)
class Columns:
    """A span of a signal, in columns.

    Attributes:
        edges: first sample of each column, and the end of the last, shape (columns + 1,).
        values: first, lowest, highest and last of each, shape (columns, 4); NaN without samples.
    """

    edges: NDArray[np.int64]
    values: Samples


class Pyramid:
    """The levels of one signal.

    Args:
        samples: the signal, shape (n,).
        levels: of blocks of 16, 128, … samples, each of shape (blocks, 4); computed if None.
    """

    def __init__(self, samples: Samples, levels: Sequence[Samples] | None = None) -> None:
        self.samples = samples
        self.levels = list(_levels(samples)) if levels is None else list(levels)

    def span(self, begin: int, end: int, width: int) -> Columns:
        """Samples `begin` to `end` in at most `width` columns.

        Columns start at block boundaries, so each is exact for its samples.
        """
        begin, end = max(begin, 0), min(end, len(self.samples))
        if end <= begin:
            return Columns(np.array([begin, begin]), np.full((1, 4), np.nan, np.float32))
        level, block = self._level((end - begin) / width)
        first, last = begin // block, -(-end // block)
        edges = np.unique(np.linspace(first, last, width + 1).astype(np.int64))
        rows = self._rows(level, first, last)
        columns = _merged(rows, edges[:-1] - first)
        return Columns(np.minimum(edges * block, len(self.samples)), columns)

    def _level(self, samples_each: float) -> tuple[int, int]:
        """Index of a sufficiently fine level (−1 for the samples) and its block length."""
        level, block = -1, 1
        for number in range(len(self.levels)):
            size = FINEST * STEP**number
            if size * 2 > samples_each:
                break
            level, block = number, size
        return level, block

    def _rows(self, level: int, first: int, last: int) -> Samples:
        if level >= 0:
            return self.levels[level][first:last]
        return np.repeat(self.samples[first:last, None], 4, axis=1)


def _levels(samples: Samples) -> list[Samples]:
    rows = np.repeat(samples[:, None], 4, axis=1)
    found, block = [], FINEST
    while len(rows) > LEAST:
        rows = _merged(rows, np.arange(0, len(rows), block))
        found.append(rows)
        block = STEP
    return found


def _merged(rows: Samples, starts: NDArray[np.int64]) -> Samples:
    """Rows merged from each start to the next, shape (starts, 4)."""
    ends = np.append(starts[1:], len(rows)) - 1
    return np.stack(
        [
            rows[starts, FIRST],
            np.fmin.reduceat(rows[:, LOW], starts),
            np.fmax.reduceat(rows[:, HIGH], starts),
            rows[ends, LAST],
        ],
        axis=1,
    )


def interleaved(times: FloatArray, columns: Columns) -> tuple[FloatArray, Samples]:
    """A line through the columns: four points each, shape (4·columns,)."""
    count = len(columns.values)
    begin, end = times[:-1], times[1:]
    along = begin[:, None] + (end - begin)[:, None] * np.array([0.0, 1 / 3, 2 / 3, 1.0]) * 0.999
    return along.reshape(4 * count), columns.values.reshape(4 * count)
