"""Samples on their way to the viewer: gathered by plot, sent as one batch of columns a plot.

Drawing sample by sample costs ten times as much of a core, and many small chunks make the viewer
lag by seconds.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
import rerun as rr

from rigwatch.dashboard.entities import TIMELINE
from rigwatch.dashboard.quantities import Plot
from rigwatch.wire.messages import Column, FloatArray, IntArray

NANOSECONDS = "datetime64[ns]"


@dataclass(slots=True)
class Batches:
    """What has not been sent yet, by path of the plot.

    Attributes:
        styled: paths whose colours and names the viewer already knows.
    """

    waiting: dict[str, list[tuple[IntArray, FloatArray]]] = field(default_factory=dict)
    styled: set[str] = field(default_factory=set)

    def add(self, plot: Plot, t_ns: IntArray, columns: Iterable[Column]) -> FloatArray:
        """Gather the plot's columns; returns what will be drawn, shape (n, series)."""
        by_name = {column.name: column.values for column in columns}
        missing = np.full(len(t_ns), np.nan)
        drawn = plot.scale * np.stack([by_name.get(s.column, missing) for s in plot.series], axis=1)
        self.waiting.setdefault(plot.path, []).append((t_ns, drawn))
        return drawn

    def send(self, stream: rr.RecordingStream, plots: dict[str, Plot]) -> None:
        """Send all that waits to the viewer, one batch a plot."""
        waiting, self.waiting = self.waiting, {}
        for path, parts in waiting.items():
            if path not in self.styled:
                _style(stream, plots[path])
                self.styled.add(path)
            times = np.concatenate([t_ns for t_ns, _ in parts]).astype(NANOSECONDS)
            values = np.concatenate([drawn for _, drawn in parts])
            column = rr.TimeColumn(TIMELINE, timestamp=times)
            rr.send_columns(path, [column], rr.Scalars.columns(scalars=values), recording=stream)


def _style(stream: rr.RecordingStream, plot: Plot) -> None:
    lines = rr.SeriesLines(
        colors=[s.colour for s in plot.series],
        names=[s.label for s in plot.series],
        widths=[s.width for s in plot.series],
    )
    stream.log(plot.path, lines, static=True)
