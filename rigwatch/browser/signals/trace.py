"""One line of a chart on disk: its samples, their times and their pyramid."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rigwatch.browser.signals.pyramid import Pyramid, Samples, interleaved
from rigwatch.wire.arrays import FloatArray

DENSE = 4
"""Samples per column below which every sample is shown."""


@dataclass(frozen=True, eq=False)
class Trace:
    """Samples over time.

    Attributes:
        pyramid: of the samples.
        times: of each sample [s], shape (n,); ascending.
    """

    pyramid: Pyramid
    times: FloatArray

    @property
    def ends(self) -> tuple[float, float]:
        """First and last time [s]."""
        return (float(self.times[0]), float(self.times[-1])) if len(self.times) else (0.0, 0.0)

    def between(self, start: float, end: float, width: int) -> tuple[FloatArray, Samples]:
        """Times and values of a line over a span, for a chart of `width` columns.

        Includes one further sample at either end, so that the line continues to the chart's edge.
        """
        first = max(int(np.searchsorted(self.times, start, "left")) - 1, 0)
        last = min(int(np.searchsorted(self.times, end, "right")) + 1, len(self.times))
        if last - first <= DENSE * width:
            return self.times[first:last], self.pyramid.samples[first:last]
        columns = self.pyramid.span(first, last, width)
        at = np.minimum(columns.edges, len(self.times) - 1)
        return interleaved(self.times[at], columns)


def write_trace(folder: Path, name: str, values: FloatArray, times: FloatArray | float) -> None:
    """Write a line; `times` are those of the samples, or the time between them [s]."""
    folder.mkdir(parents=True, exist_ok=True)
    samples = np.asarray(values, np.float32)
    np.save(folder / f"{name}.npy", samples)
    for number, level in enumerate(Pyramid(samples).levels):
        np.save(folder / f"{name}.{number}.npy", level)
    np.save(folder / f"{name}.time.npy", np.atleast_1d(np.asarray(times, np.float64)))


def open_trace(folder: Path, name: str) -> Trace:
    """Open a written line; its samples are memory-mapped.

    Raises:
        FileNotFoundError: there is none.
    """
    samples = np.load(folder / f"{name}.npy", mmap_mode="r")
    count = len(list(folder.glob(f"{name}.[0-9].npy")))
    levels = [np.load(folder / f"{name}.{k}.npy", mmap_mode="r") for k in range(count)]
    times = np.load(folder / f"{name}.time.npy", mmap_mode="r")
    if len(times) != len(samples):
        times = np.arange(len(samples)) * float(times[0])
    return Trace(Pyramid(samples, levels), times)
