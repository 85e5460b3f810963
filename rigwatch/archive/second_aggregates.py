"""Estimates as figures per second: number, mean, least and largest value of each column.

    rig=<rig>/day=<YYYY-MM-DD>/<session's hash>.parquet
    name, unit, second, count, mean, low, high      sorted by name and second

Seconds are those of UTC. Sums run over the finite values of a second; one that is cut by two blocks
is joined, and an estimate that was recorded twice counts once.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import EstimateBlock, Streams

SECOND_NS = 1_000_000_000
DAY_S = 86_400
_TOGETHER = 1 << 14
"""Samples whose figures are computed together."""
Figures = NDArray[np.float64]


@dataclass(slots=True)
class _Series:
    """Parts of one column: seconds (n,), and count, sum, low and high of each (n, 4)."""

    unit: str
    seconds: list[NDArray[np.int64]] = field(default_factory=list)
    figures: list[Figures] = field(default_factory=list)

    def table(self) -> tuple[NDArray[np.int64], Figures]:
        """Each second once, in order."""
        seconds, figures = np.concatenate(self.seconds), np.concatenate(self.figures)
        order = np.argsort(seconds, kind="stable")
        seconds, figures = seconds[order], figures[order]
        starts = np.flatnonzero(np.diff(seconds, prepend=seconds[0] - 1))
        return seconds[starts], _joined(figures, starts)


class SecondAggregates:
    """Accumulates the estimates of a session."""

    def __init__(self) -> None:
        self._series: dict[str, _Series] = {}
        self._streams = Streams()
        self._waiting: list[EstimateBlock] = []
        self._samples = 0

    def add(self, block: EstimateBlock) -> None:
        """Take the estimates of a block that are new."""
        fresh = self._streams.fresh(block)
        if fresh is None or not len(fresh):
            return
        self._waiting.append(fresh)
        self._samples += len(fresh)
        if self._samples >= _TOGETHER:
            self._reduce()

    def _reduce(self) -> None:
        """Figures of all blocks that wait, those with the same columns together."""
        for columns, found in groupby(self._waiting, key=_columns):
            self._add(columns, list(found))
        self._waiting, self._samples = [], 0

    def _add(self, columns: tuple[tuple[str, str], ...], found: list[EstimateBlock]) -> None:
        seconds = np.concatenate([block.t_ns for block in found]) // SECOND_NS
        starts = np.flatnonzero(np.diff(seconds, prepend=seconds[0] - 1))
        parts = [np.stack([column.values for column in block.columns]) for block in found]
        figures = _figures(np.concatenate(parts, axis=1), starts)
        for place, (name, unit) in enumerate(columns):
            series = self._series.setdefault(name, _Series(unit))
            series.seconds.append(seconds[starts])
            series.figures.append(figures[place])

    def days(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Each day and its table: columns by name, each an array, texts as runs."""
        self._reduce()
        parts = [part for name in sorted(self._series) for part in self._by_day(name)]
        parts.sort(key=lambda part: part[0])
        for day, found in groupby(parts, key=lambda part: part[0]):
            yield day, _whole([table for _, table in found])

    def _by_day(self, name: str) -> Iterator[tuple[str, dict[str, Any]]]:
        series = self._series[name]
        seconds, figures = series.table()
        usable = figures[:, 0] > 0
        seconds, figures = seconds[usable], figures[usable]
        days = seconds // DAY_S
        for day in np.unique(days):
            here = days == day
            yield day_name(int(day) * DAY_S), _rows(name, series.unit, seconds[here], figures[here])


def day_name(second: int) -> str:
    """The day of a second of Unix time, UTC."""
    return datetime.fromtimestamp(second, UTC).strftime("%Y-%m-%d")


def _columns(block: EstimateBlock) -> tuple[tuple[str, str], ...]:
    return tuple((column.name, column.unit) for column in block.columns)


def _figures(values: FloatArray, starts: NDArray[np.intp]) -> Figures:
    """Figures (columns, seconds, 4) of values (columns, samples)."""
    finite = np.isfinite(values)
    return np.stack(
        (
            np.add.reduceat(finite, starts, axis=1, dtype=np.float64),
            np.add.reduceat(np.where(finite, values, 0.0), starts, axis=1),
            np.minimum.reduceat(np.where(finite, values, np.inf), starts, axis=1),
            np.maximum.reduceat(np.where(finite, values, -np.inf), starts, axis=1),
        ),
        axis=2,
    )


def _joined(figures: Figures, starts: NDArray[np.intp]) -> Figures:
    sums = np.add.reduceat(figures[:, :2], starts)
    low = np.minimum.reduceat(figures[:, 2], starts)
    high = np.maximum.reduceat(figures[:, 3], starts)
    return np.column_stack((sums, low, high))


def _rows(name: str, unit: str, seconds: NDArray[np.int64], figures: Figures) -> dict[str, Any]:
    count = len(seconds)
    return {
        "name": [(name, count)],
        "unit": [(unit, count)],
        "second": seconds,
        "count": figures[:, 0].astype(np.int32),
        "mean": figures[:, 1] / figures[:, 0],
        "low": figures[:, 2],
        "high": figures[:, 3],
    }


def _whole(tables: list[dict[str, Any]]) -> dict[str, Any]:
    """Tables below each other."""
    texts = ("name", "unit")
    return {
        key: [run for table in tables for run in table[key]]
        if key in texts
        else np.concatenate([table[key] for table in tables])
        for key in tables[0]
    }
