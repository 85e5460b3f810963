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
from rigwatch.wire.messages import Column, EstimateBlock, blocks

SECOND_NS = 1_000_000_000
DAY_S = 86_400
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
        self._next: dict[tuple[str, int], int] = {}

    def add(self, block: EstimateBlock) -> None:
        """Take the estimates of a block that are new."""
        key = (block.device, block.boot)
        fresh = blocks.unseen(block, self._next.get(key))
        if fresh is None or not len(fresh):
            return
        self._next[key] = fresh.seq + len(fresh)
        seconds = fresh.t_ns // SECOND_NS
        starts = np.flatnonzero(np.diff(seconds, prepend=seconds[0] - 1))
        for column in fresh.columns:
            self._add(column, seconds[starts], starts)

    def _add(self, column: Column, seconds: NDArray[np.int64], starts: NDArray[np.intp]) -> None:
        series = self._series.setdefault(column.name, _Series(column.unit))
        series.seconds.append(seconds)
        series.figures.append(_figures(column.values, starts))

    def days(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Each day and its table: columns by name, each an array or a list."""
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


def _figures(values: FloatArray, starts: NDArray[np.intp]) -> Figures:
    finite = np.isfinite(values)
    return np.column_stack(
        (
            np.add.reduceat(finite, starts, dtype=np.float64),
            np.add.reduceat(np.where(finite, values, 0.0), starts),
            np.minimum.reduceat(np.where(finite, values, np.inf), starts),
            np.maximum.reduceat(np.where(finite, values, -np.inf), starts),
        )
    )


def _joined(figures: Figures, starts: NDArray[np.intp]) -> Figures:
    sums = np.add.reduceat(figures[:, :2], starts)
    low = np.minimum.reduceat(figures[:, 2], starts)
    high = np.maximum.reduceat(figures[:, 3], starts)
    return np.column_stack((sums, low, high))


def _rows(name: str, unit: str, seconds: NDArray[np.int64], figures: Figures) -> dict[str, Any]:
    count = len(seconds)
    return {
        "name": [name] * count,
        "unit": [unit] * count,
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
        key: [text for table in tables for text in table[key]]
        if key in texts
        else np.concatenate([table[key] for table in tables])
        for key in tables[0]
    }
