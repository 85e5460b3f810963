"""Maps the columns of messages to plots: one row per plot, one line per series.

A plot is one entity with several scalars, sent to the viewer as one batch. The plot exists if the
message has its `key` column. Other missing columns come from the marks, constant figures such as
the signature of a fault, or are omitted. Columns without a row get a plot of their own.
"""

from collections.abc import Collection
from dataclasses import dataclass

from rigwatch.dashboard.board import palette
from rigwatch.dashboard.board.palette import Colour
from rigwatch.wire.messages import Column


@dataclass(frozen=True, slots=True)
class Series:
    """One line of a plot; later ones are drawn on top.

    Attributes:
        column: name of the column in the message, or of a mark.
        label: text in the legend.
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
        key: the required column.
        series: its scalars, in order.
        title: title of its view, without the unit.
        scale: the drawn value is the SI value times this.
        unit: unit of the drawn value; "" takes the column's own.
    """

    path: str
    key: str
    series: tuple[Series, ...]
    title: str
    scale: float = 1.0
    unit: str = ""


def _single(path: str, column: str, title: str, colour: Colour) -> Plot:
    return Plot(path, column, (Series(column, title.lower(), colour),), title)


def _limits(column: str) -> tuple[Series, Series]:
    """Both limits under one name, so that the legend lists them once."""
    return (
        Series(f"{column}_low", "limit", palette.LIMIT, 1.2),
        Series(f"{column}_high", "limit", palette.LIMIT, 1.2),
    )


def _friction(path: str, column: str, label: str, title: str, colour: Colour) -> Plot:
    signature = Series(f"{column}_signature", "signature", palette.SIGNATURE, 1.2)
    series = (*_limits(column), signature, Series(column, label, colour, 2.0))
    return Plot(path, column, series, title)


VOLTAGE = _single("signals/voltage", "voltage", "Servo voltage", palette.VOLTAGE)
FORCE = _single("signals/force", "force", "Force", palette.VOLTAGE)
POSITION = Plot(
    "signals/position",
    "position",
    (Series("position", "position", palette.POSITION),),
    "Position",
    scale=1e3,
    unit="mm",
)
ACCELERATION_TITLE = "Acceleration, measured and modelled"
ACCELERATION = "signals/acceleration"
MEASURED = Plot(
    f"{ACCELERATION}/measured",
    "acceleration",
    (Series("acceleration", "measured", palette.ACCELERATION, 2.5),),
    ACCELERATION_TITLE,
)
MODELLED = Plot(
    f"{ACCELERATION}/modelled",
    "modelled_acceleration",
    (Series("modelled_acceleration", "modelled", palette.MODEL, 1.2),),
    ACCELERATION_TITLE,
)
RESIDUAL = Plot(
    "monitor/residual",
    "residual",
    (
        *_limits("change"),
        Series("residual", "residual", palette.RESIDUAL),
        Series("change", "change since healthy", palette.CHANGE),
    ),
    "Residual acceleration and its change, with limits",
)
THETA1 = _friction(
    "monitor/theta1",
    "theta1",
    "θ1",
    "Coulomb friction θ1 with thresholds and signature",
    palette.THETA1,
)
THETA2 = _friction(
    "monitor/theta2",
    "theta2",
    "θ2",
    "Viscous friction θ2 with thresholds and signature",
    palette.THETA2,
)
DEVIATION = Plot(
    "details/deviation",
    "deviation",
    (
        Series("deviation_high", "limit", palette.LIMIT, 1.2),
        Series("deviation", "deviation", palette.DEVIATION),
    ),
    "Deviation from the healthy rig, in standard deviations",
)
SHARES = Plot(
    "details/shares",
    "friction_fit",
    (
        Series("friction_fit", "explained by friction", palette.THETA1),
        Series("friction_share", "jump at reversals", palette.THETA2),
        Series("rho", "correlation with the jump", palette.VOLTAGE),
        Series("together", "explained with all rivals", palette.MODEL),
        Series("rest", "time at rest", palette.POSITION),
    ),
    "What the change looks like, as shares",
)
VELOCITY = _single(
    "details/velocity", "velocity", "Velocity, from the accelerometer", palette.VELOCITY
)

SAMPLE_PLOTS = (VOLTAGE, FORCE, POSITION, MEASURED)
ESTIMATE_PLOTS = (MODELLED, RESIDUAL, THETA1, THETA2, DEVIATION, SHARES, VELOCITY)
FRICTION = (THETA1.path, THETA2.path)
DETAILS = "details"
_IN_WORDS = {"armed", "observable", "verdict"}
_PLACED = _IN_WORDS | {s.column for p in (*SAMPLE_PLOTS, *ESTIMATE_PLOTS) for s in p.series}


def plots_of(columns: Collection[Column], table: tuple[Plot, ...], others: str) -> list[Plot]:
    """The rows of `table` for these columns, and a plot below `others` for each other column."""
    names = {column.name for column in columns}
    strangers = [column.name for column in columns if column.name not in _PLACED]
    own = [
        _single(f"{others}/{name}", name, name.replace("_", " ").capitalize(), colour_at(place))
        for place, name in enumerate(strangers)
    ]
    return [plot for plot in table if plot.key in names] + own


def colour_at(place: int) -> Colour:
    """The colour of a line by its index among those without a colour of their own."""
    return palette.OTHERS[place % len(palette.OTHERS)]
