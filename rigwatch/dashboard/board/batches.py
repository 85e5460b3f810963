"""Collects samples for the viewer by plot and sends one batch of columns per plot.

Drawing sample by sample takes ten times the processor time, and many small chunks make the viewer
lag by seconds.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import rerun as rr

from rigwatch.dashboard.board.entities import TIMELINE
from rigwatch.dashboard.board.quantities import Plot
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.messages import Column

NANOSECONDS = "datetime64[ns]"


@dataclass(slots=True)
class Batches:
    """The data not sent yet, by path of the plot.

    Attributes:
        marks: constant figures, such as "theta1_signature", by name.
        waiting: times and values, by path.
        styled: paths whose colours and names the viewer already has.
    """

    marks: Mapping[str, float]
    waiting: dict[str, list[tuple[IntArray, FloatArray]]] = field(default_factory=dict)
    styled: set[str] = field(default_factory=set)

    def add(self, plot: Plot, t_ns: IntArray, columns: Iterable[Column]) -> FloatArray:
        """Collect the plot's columns; returns the values to draw, shape (n, series)."""
        by_name = {column.name: column.values for column in columns}
        drawn = np.empty((len(t_ns), len(plot.series)))
        for place, series in enumerate(plot.series):
            mark = self.marks.get(series.column, np.nan)
            drawn[:, place] = plot.scale * by_name.get(series.column, mark)
        self.waiting.setdefault(plot.path, []).append((t_ns, drawn))
        return drawn

    def send(self, stream: rr.RecordingStream, plots: dict[str, Plot]) -> None:
        """Send everything to the viewer, one batch per plot."""
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
