"""Curves as SVG, and as characters for a terminal."""

import numpy as np

from rigwatch.page import Plot, limits
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.catalogue.effect_curves import Curve

WIDTH, HEIGHT = 320, 220
"""Of a picture [pixels]."""
COLUMNS, LINES = 56, 13
"""Size of a text drawing in characters."""


def plotted(curve: Curve, title: str) -> str:
    """A curve as an SVG document."""
    plot = Plot(
        title, limits(curve.x), limits(curve.y), curve.across, curve.up, width=WIDTH, height=HEIGHT
    )
    plot.line(curve.x, curve.y, "model")
    return plot.document()


def text_plot(curve: Curve) -> list[str]:
    """A curve as lines of characters, its ends at the edges."""
    cells = [[" "] * COLUMNS for _ in range(LINES)]
    rows, columns = _cells(curve.y, LINES), _cells(curve.x, COLUMNS)
    for row, column in zip(rows, columns, strict=True):
        cells[LINES - 1 - row][column] = "*"
    low, high = float(np.nanmin(curve.y)), float(np.nanmax(curve.y))
    edges = {0: f"{high:.3g}", LINES - 1: f"{low:.3g}"}
    body = [f"{edges.get(n, ''):>9} |{''.join(line).rstrip()}" for n, line in enumerate(cells)]
    left, right = f"{float(np.nanmin(curve.x)):.3g}", f"{float(np.nanmax(curve.x)):.3g}"
    foot = f"{left}{curve.across:^{COLUMNS - len(left) - len(right)}}{right}"
    return [f"{curve.up} against {curve.across}", *body, f"{'':>9} +{'-' * COLUMNS}",
            f"{'':>11}{foot}"]  # fmt: skip


def _cells(values: FloatArray, count: int) -> list[int]:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    share = (values - low) / ((high - low) or 1.0)
    return [round(s) for s in (np.nan_to_num(share) * (count - 1)).tolist()]
