"""The data seen so far, as far as the layout depends on them: plots, units, axis ranges.

The layout is resent when `Survey.plan` changes, which is rare as its ranges move in wide steps.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

from rigwatch.dashboard.board import quantities
from rigwatch.dashboard.board.quantities import Plot
from rigwatch.dashboard.board.ranges import Range, around_signature, peak, symmetric
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import Column


@dataclass(frozen=True, slots=True)
class PlotPlan:
    """The display of one plot.

    Attributes:
        plot: the row of the table.
        unit: unit of the drawn values.
        range: range of the vertical axis; None if nothing is known yet.
    """

    plot: Plot
    unit: str
    range: Range | None

    @property
    def title(self) -> str:
        """Title of the plot's view, with the unit."""
        shown = self.unit.replace("^2", "²").replace("^3", "³")
        return f"{self.plot.title} [{shown}]" if shown not in ("", "1") else self.plot.title


@dataclass(slots=True)
class Survey:
    """Peaks, limits and units by plot.

    Attributes:
        plots: by path, in order of first appearance.
        units: unit of the drawn values, by path.
        peaks: largest magnitude drawn so far, by path.
        marks: last (signature, low, high) of plots that have a signature, by path.
    """

    plots: dict[str, Plot] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    peaks: dict[str, float] = field(default_factory=dict)
    marks: dict[str, tuple[float, float, float]] = field(default_factory=dict)

    def see(self, plot: Plot, columns: Iterable[Column], drawn: FloatArray) -> None:
        """Record values drawn in a plot, shape (n, series)."""
        if plot.path not in self.plots:
            self.plots[plot.path] = plot
            own = next(c.unit for c in columns if c.name == plot.key)
            self.units[plot.path] = plot.unit or own
        self.peaks[plot.path] = max(self.peaks.get(plot.path, 0.0), peak(drawn))
        if plot.path in quantities.FRICTION and len(drawn):
            low, high, signature = drawn[-1, :3]
            self.marks[plot.path] = (float(signature), float(low), float(high))

    def plan(self) -> tuple[PlotPlan, ...]:
        """The display of each plot, given all data so far."""
        return tuple(
            PlotPlan(plot, self.units[path], self._range(path)) for path, plot in self.plots.items()
        )

    def _range(self, path: str) -> Range | None:
        if path.startswith(quantities.DETAILS):
            return None
        if path in self.marks and (span := around_signature(*self.marks[path])):
            return span
        return symmetric(max(self.peaks[other] for other in self.peaks if _one_axis(other, path)))


def _one_axis(path: str, other: str) -> bool:
    """Measured and modelled acceleration share one plot."""
    pair = (quantities.MEASURED.path, quantities.MODELLED.path)
    return path == other or (path in pair and other in pair)
