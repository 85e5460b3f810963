"""A foreign file as it would be imported: rate, remarks, and each channel in its unit."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.browser.recordings.channels import write_channels
from rigwatch.browser.signals import Trace, open_trace
from rigwatch.browser.work import Results
from rigwatch.page import Plot, limits
from rigwatch.wire.exchange import ImportMapping, import_file
from rigwatch.wire.session import SUFFIX

WIDTH, HEIGHT, POINTS = 320, 130, 30
"""Size of a picture [pixels], and most rows of its table."""


def import_preview(source: Path, mapping: ImportMapping) -> dict[str, Any]:
    """Import a file into a temporary session and show its channels.

    Raises:
        ImportDataError: the mapping does not fit the file.
    """
    with tempfile.TemporaryDirectory() as place:
        target = Path(place) / f"preview{SUFFIX}"
        made = import_file(source, target, mapping)
        kept = Results(Path(place) / "shown")
        found = write_channels(kept, target)
        figures = [
            _figure(name, unit, open_trace(kept.folder / "signals", name))
            for name, unit in found["channels"].items()
        ]
    return {
        "samples": made.samples,
        "rate": made.rate_hz,
        "seconds": found["seconds"],
        "remarks": made.remarks,
        "figures": figures,
    }


def _figure(name: str, unit: str, trace: Trace) -> dict[str, Any]:
    """A channel as a picture, with some of its points."""
    times, values = trace.between(*trace.ends, WIDTH)
    shown = np.asarray(values, np.float64)
    axis = f"{name} [{unit}]"
    plot = Plot(name, trace.ends, limits(shown), "time [s]", axis, WIDTH, HEIGHT)
    plot.line(np.asarray(times, np.float64), shown, "measured")
    taken = np.unique(np.linspace(0, len(times) - 1, POINTS).astype(int))
    points = [[float(f"{times[k]:.5g}"), float(f"{shown[k]:.5g}")] for k in taken.tolist()]
    good = np.asarray(np.isfinite(shown))
    ends = f"{shown[good].min():.4g} to {shown[good].max():.4g} {unit}" if good.any() else "empty"
    return {
        "title": f"{name}: {ends}",
        "svg": str(plot.drawn()),
        "axes": ["time [s]", axis],
        "points": [[a, b if np.isfinite(b) else None] for a, b in points],
    }
