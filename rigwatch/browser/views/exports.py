"""Exports of a chart over the displayed span: figure as SVG, numbers as CSV."""

import csv
import io
from collections.abc import Mapping

import numpy as np

from rigwatch.browser.signals import Trace
from rigwatch.page import Plot, limits
from rigwatch.wire.arrays import FloatArray

COLOURS = {"measured": "measured", "modelled": "model", "residual": "rest", "preview": "held"}
WIDE = 900


def figure_svg(title: str, axis: str, lines: Mapping[str, Trace], span: tuple[float, float]) -> str:
    """The lines over a span, as an SVG file in the colours of the light theme."""
    drawn = {name: trace.between(*span, WIDE) for name, trace in lines.items()}
    values = [np.asarray(y, np.float64) for _, y in drawn.values()]
    plot = Plot(
        title, span, limits(*values), "time [s]", axis, 900, 320,
        legend=[(COLOURS.get(name, "held"), name) for name in lines],
    )  # fmt: skip
    for name, (x, y) in drawn.items():
        plot.line(x, np.asarray(y, np.float64), COLOURS.get(name, "held"), name=name)
    return plot.document()


def figure_csv(axis: str, lines: Mapping[str, Trace], span: tuple[float, float]) -> str:
    """All samples of the lines within a span; lines with different times have separate rows."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["time [s]", *(f"{name}: {axis}" for name in lines)])
    cut = {name: _samples(trace, span) for name, trace in lines.items()}
    names = list(cut)
    times = np.unique(np.concatenate([x for x, _ in cut.values()]))
    columns = [dict(zip(x.tolist(), y.tolist(), strict=True)) for x, y in cut.values()]
    for at in times.tolist():
        writer.writerow([repr(at), *(column.get(at, "") for column in columns[: len(names)])])
    return out.getvalue()


def _samples(trace: Trace, span: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    first, last = trace.within(*span)
    values = np.asarray(trace.pyramid.samples[first:last], np.float64)
    return trace.at(np.arange(first, last)), values
