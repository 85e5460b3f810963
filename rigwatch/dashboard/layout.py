"""Where everything stands on the screen: the blueprint of the viewer.

    Watch    signals and residual on the left, verdict, alarm states and friction estimates on the
    right Health   what the processes report: rates, losses, errors, latency

Short windows follow the cursor for signals, long ones for estimates and alarms, so that both the
motion and the history can be read.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb

from rigwatch.dashboard import entities as at
from rigwatch.dashboard import quantities
from rigwatch.dashboard.survey import PlotPlan

_TITLES = {
    quantities.VOLTAGE.path: "Servo voltage",
    quantities.FORCE.path: "Force",
    quantities.POSITION.path: "Position",
    quantities.RESIDUAL.path: "Residual acceleration with limits",
    quantities.THETA1.path: "Coulomb friction θ1 with thresholds and signature",
    quantities.THETA2.path: "Viscous friction θ2 with thresholds and signature",
}
FRICTION = (quantities.THETA1.path, quantities.THETA2.path)
ACCELERATION_TITLE = "Acceleration, measured and modelled"


@dataclass(frozen=True, slots=True)
class Windows:
    """How much time the plots show, up to the cursor.

    Attributes:
        signals: of signals and residual [s]; None shows everything.
        history: of estimates and alarm states [s]; None shows everything.
    """

    signals: float | None = 5.0
    history: float | None = 60.0


def blueprint(plan: Sequence[PlotPlan], windows: Windows, *, live: bool) -> rrb.Blueprint:
    """The whole layout for the plots that exist.

    Args:
        plan: the plots, with units and ranges.
        windows: how much time they show.
        live: whether the cursor follows the newest data.
    """
    return rrb.Blueprint(
        rrb.Tabs(_watch(plan, windows), _health(windows), active_tab=0),
        rrb.TimePanel(
            state="collapsed", timeline=at.TIMELINE, play_state="following" if live else "paused"
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def title_of(plan: PlotPlan) -> str:
    """Title of a plot's view, with the unit."""
    return f"{_TITLES.get(plan.plot.path, plan.plot.series[-1].label.capitalize())}{_in(plan.unit)}"


def _in(unit: str) -> str:
    shown = unit.replace("^2", "²").replace("^3", "³")
    return f" [{shown}]" if unit not in ("", "1") else ""


def _watch(plan: Sequence[PlotPlan], windows: Windows) -> rrb.Container:
    by_path = {line.plot.path: line for line in plan}
    friction = [by_path[path] for path in FRICTION if path in by_path]
    right: list[rrb.Container | rrb.View] = [
        rrb.Horizontal(
            rrb.TextDocumentView(origin=at.ADVICE if plan else at.WAITING, name=at.ADVICE_VIEW),
            rrb.TextDocumentView(origin=at.STATUS, name=at.STATUS_VIEW),
        ),
        _states_view(at.LANES, at.ALARMS_VIEW, windows),
        *(_series_view(line, windows.history) for line in friction),
        _log_view(at.LOG, at.LOG_VIEW),
    ]
    shares = [2.8, 2.2, *[1.9] * len(friction), 1.4]
    columns: list[rrb.Container] = [rrb.Vertical(*right, row_shares=shares)]
    if left := _signal_views(plan, windows):
        columns.insert(0, rrb.Vertical(*left))
    return rrb.Vertical(
        _states_view(at.VERDICT, at.VERDICT_VIEW, windows),
        rrb.Horizontal(*columns, column_shares=[6, 5][-len(columns) :]),
        row_shares=[1, 9],
        name="Watch",
    )


def _states_view(origin: str, name: str, windows: Windows) -> rrb.View:
    return rrb.StateTimelineView(origin=origin, name=name, time_view=_time_axis(windows.history))


def _log_view(origin: str, name: str) -> rrb.View:
    return rrb.TextLogView(
        origin=origin, name=name, columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    )


def _signal_views(plan: Sequence[PlotPlan], windows: Windows) -> list[rrb.View]:
    """One view a signal, in the order of the table; both accelerations in one."""
    views: list[rrb.View] = []
    order = [plot.path for plot in (*quantities.SAMPLE_PLOTS, *quantities.ESTIMATE_PLOTS)]
    lines = sorted(plan, key=lambda p: order.index(p.plot.path) if p.plot.path in order else 3.5)
    pair = (quantities.MEASURED.path, quantities.MODELLED.path)
    done: set[str] = set()
    for line in lines:
        path = line.plot.path
        if path in FRICTION or path in done:
            continue
        if path in pair:
            done.update(pair)
            views.append(_acceleration_view(line, windows.signals))
        else:
            views.append(_series_view(line, windows.signals))
    return views


def _series_view(line: PlotPlan, window: float | None) -> rrb.View:
    many = len(line.plot.series) > 1
    return _time_series(line.plot.path, title_of(line), line, window, legend=many)


def _acceleration_view(line: PlotPlan, window: float | None) -> rrb.View:
    title = f"{ACCELERATION_TITLE}{_in(line.unit)}"
    return _time_series("signals/acceleration", title, line, window, legend=True)


def _time_series(
    origin: str, name: str, line: PlotPlan, window: float | None, *, legend: bool
) -> rrb.View:
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_x=_time_axis(window),
        axis_y=rrb.ScalarAxis(range=line.range) if line.range else None,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
        time_ranges=_visible(window),
    )


def _visible(window: float | None) -> rrb.VisibleTimeRange | None:
    if window is None:
        return None
    return rrb.VisibleTimeRange(
        at.TIMELINE,
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-window),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )


def _time_axis(window: float | None) -> rrb.TimeAxis | None:
    if window is None:
        return None
    return rrb.TimeAxis(
        view_range=rrb.TimeRange(
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-window),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        )
    )


def _health(windows: Windows) -> rrb.Container:
    views = [
        rrb.TimeSeriesView(
            origin=f"{at.HEALTH}/{kind}",
            name=title,
            time_ranges=_visible(windows.history),
            plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
        )
        for kind, title in at.HEALTH_VIEWS.items()
    ]
    log = _log_view(at.EVENTS, at.EVENTS_VIEW)
    return rrb.Grid(*views, log, grid_columns=2, name="Health")
