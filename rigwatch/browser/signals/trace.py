"""One line of a chart on disk: its samples, their times and their pyramid."""

import glob
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from rigwatch.browser.signals.pyramid import Pyramid, Samples, interleaved
from rigwatch.wire.arrays import FloatArray, IntArray

DENSE = 4
"""Samples per column below which every sample is shown."""


@dataclass(frozen=True, eq=False)
class Trace:
    """Samples over time.

    Attributes:
        pyramid: of the samples.
        times: of each sample [s], shape (n,), ascending; or the time between samples, shape (1,).
    """

    pyramid: Pyramid
    times: FloatArray

    def __len__(self) -> int:
        return len(self.pyramid.samples)

    @property
    def even(self) -> bool:
        """Whether samples follow each other in equal steps from 0 s on."""
        return len(self.times) != len(self)

    @property
    def ends(self) -> tuple[float, float]:
        """First and last time [s]."""
        if not len(self):
            return 0.0, 0.0
        first, last = self.at(np.array([0, len(self) - 1]))
        return float(first), float(last)

    def at(self, numbers: IntArray) -> FloatArray:
        """Times of samples [s], by their numbers."""
        found = numbers * float(self.times[0]) if self.even else self.times[numbers]
        return np.asarray(found, np.float64)

    def within(self, start: float, end: float) -> tuple[int, int]:
        """Numbers of the first sample from `start` on and of the first after `end` [s]."""
        if self.even:
            return self._first(start, "left"), self._first(end, "right")
        first, last = np.searchsorted(self.times, start), np.searchsorted(self.times, end, "right")
        return int(first), int(last)

    def _first(self, time: float, side: Literal["left", "right"]) -> int:
        """Number of the first sample at or after a time ("left"), or only after it ("right")."""
        step = float(self.times[0])
        near = int(np.clip(np.floor(time / step), 0, len(self)))
        # The quotient may be rounded over a whole number: the samples beside it are looked at.
        beside = np.arange(max(near - 1, 0), min(near + 2, len(self)))
        return int(max(near - 1, 0) + np.searchsorted(beside * step, time, side))

    def between(self, start: float, end: float, width: int) -> tuple[FloatArray, Samples]:
        """Times and values of a line over a span, for a chart of `width` columns.

        Includes one further sample at either end, so that the line continues to the chart's edge.
        """
        first, last = self.within(start, end)
        first, last = max(first - 1, 0), min(last + 1, len(self))
        if last - first <= DENSE * width:
            return self.at(np.arange(first, last)), self.pyramid.samples[first:last]
        columns = self.pyramid.span(first, last, width)
        return interleaved(self.at(np.minimum(columns.edges, len(self) - 1)), columns)


def write_trace(folder: Path, name: str, values: FloatArray, times: FloatArray | float) -> None:
    """Write a line; `times` are those of the samples, or the time between them [s]."""
    folder.mkdir(parents=True, exist_ok=True)
    samples = np.asarray(values, np.float32)
    np.save(folder / f"{name}.npy", samples)
    for number, level in enumerate(Pyramid(samples).levels):
        np.save(folder / f"{name}.{number}.npy", level)
    at = np.atleast_1d(np.asarray(times, np.float64))
    if len(at) > 1 and np.array_equal(at, np.arange(len(at)) * at[1]):
        at = at[1:2]
    np.save(folder / f"{name}.time.npy", at)


def open_trace(folder: Path, name: str) -> Trace:
    """Open a written line; its samples are memory-mapped.

    Raises:
        FileNotFoundError: there is none.
    """
    samples = np.load(folder / f"{name}.npy", mmap_mode="r")
    count = len(list(folder.glob(f"{glob.escape(name)}.[0-9].npy")))
    levels = [np.load(folder / f"{name}.{k}.npy", mmap_mode="r") for k in range(count)]
    times = np.load(folder / f"{name}.time.npy", mmap_mode="r")
    return Trace(Pyramid(samples, levels), times)
