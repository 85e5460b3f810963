"""Which column of a message is drawn where: one row a plot, one line a series.

A plot is one entity with several scalars, so that one batch a plot travels to the viewer. Its last
series, which is drawn on top, decides whether the plot exists; a message without the others leaves
them out (NaN). Channels without a row of their own get a plot each under `signals/other`.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from rigwatch.dashboard import palette
from rigwatch.dashboard.palette import Colour
from rigwatch.wire.messages import Column


@dataclass(frozen=True, slots=True)
class Series:
    """One line of a plot.

    Attributes:
        column: name of the column in the message.
        label: what the legend says.
        colour: (red, green, blue).
        width: stroke width in points.
    """

    column: str
    label: str
    colour: Colour
    width: float = 1.5


@dataclass(frozen=True, slots=True)
class Plot:
    """One entity of the viewer.

    Attributes:
        path: the entity.
        series: its scalars, in order.
        scale: the drawn value is the SI value times this.
        unit: unit of the drawn value; "" takes the column's own.
    """

    path: str
    series: tuple[Series, ...]
    scale: float = 1.0
    unit: str = ""

    @property
    def key(self) -> str:
        """Name of the column that decides whether the plot exists."""
        return self.series[-1].column


def _limited(path: str, column: str, label: str, colour: Colour) -> Plot:
    limits = (
        Series(f"{column}_low", "limit", palette.LIMIT, 1.2),
        Series(f"{column}_high", "limit", palette.LIMIT, 1.2),
    )
    return Plot(path, (*limits, Series(column, label, colour)))


def _friction(path: str, column: str, label: str, colour: Colour) -> Plot:
    low, high, estimate = _limited(path, column, label, colour).series
    signature = Series(f"{column}_signature", "signature", palette.SIGNATURE, 1.2)
    return Plot(path, (low, high, signature, estimate))


VOLTAGE = Plot("signals/voltage", (Series("voltage", "servo voltage", palette.VOLTAGE),))
FORCE = Plot("signals/force", (Series("force", "force", palette.VOLTAGE),))
POSITION = Plot("signals/position", (Series("position", "position", palette.POSITION),), 1e3, "mm")
MEASURED = Plot(
    "signals/acceleration/measured", (Series("acceleration", "measured", palette.ACCELERATION),)
)
MODELLED = Plot(
    "signals/acceleration/modelled", (Series("acceleration_model", "modelled", palette.MODEL),)
)
RESIDUAL = _limited("monitor/residual", "residual", "residual", palette.RESIDUAL)
THETA1 = _friction("monitor/theta1", "theta1", "θ1", palette.THETA1)
THETA2 = _friction("monitor/theta2", "theta2", "θ2", palette.THETA2)

SAMPLE_PLOTS = (VOLTAGE, FORCE, POSITION, MEASURED)
ESTIMATE_PLOTS = (MODELLED, RESIDUAL, THETA1, THETA2)
OTHER = "signals/other"


def other_plot(column: Column, index: int) -> Plot:
    """The plot of a channel that has no row above."""
    colour = palette.OTHERS[index % len(palette.OTHERS)]
    return Plot(f"{OTHER}/{column.name}", (Series(column.name, column.name, colour),))


def plots_of(columns: Iterable[Column], table: tuple[Plot, ...]) -> list[Plot]:
    """The rows of `table` whose key is among `columns`."""
    names = {column.name for column in columns}
    return [plot for plot in table if plot.key in names]
