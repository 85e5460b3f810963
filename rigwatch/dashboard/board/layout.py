"""The layout of the screen: the blueprint of the viewer.

    Watch    signals and residual on the left; verdict, alarm states and estimates on the right
    Health   what the processes report: rates, losses, errors, latency

Short windows follow the cursor for signals, long ones for estimates and alarms, so that both the
motion and the history can be read.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb

from rigwatch.dashboard.board import entities as at
from rigwatch.dashboard.board import quantities
from rigwatch.dashboard.board.quantities import DETAILS
from rigwatch.dashboard.board.survey import PlotPlan


@dataclass(frozen=True, slots=True)
class Windows:
    """The time span of the plots, up to the cursor.

    Attributes:
        signals: span of signals and residual [s]; None shows everything.
        history: span of estimates and alarm states [s]; None shows everything.
    """

    signals: float | None = 5.0
    history: float | None = 60.0


def blueprint(plan: Sequence[PlotPlan], windows: Windows, *, bare: bool) -> rrb.Blueprint:
    """The whole layout for the plots that exist.

    Args:
        plan: the plots, with units and ranges.
        windows: their time span.
        bare: hide the controls of the viewer.
    """
    return screen(
        rrb.Tabs(*_tabs(plan, windows), active_tab=0), at.TIMELINE, follow=True, bare=bare
    )


def screen(
    content: rrb.Container, timeline: str, *, follow: bool = False, bare: bool
) -> rrb.Blueprint:
    """The viewer's screen with this content and none of its own views.

    Args:
        content: views.
        timeline: the timeline shown.
        follow: keep the cursor at the newest data.
        bare: hide the controls of the viewer.
    """
    return rrb.Blueprint(
        content,
        rrb.TopPanel(state="hidden" if bare else "expanded"),
        rrb.TimePanel(
            state="hidden" if bare else "collapsed",
            timeline=timeline,
            play_state="following" if follow else None,
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _tabs(plan: Sequence[PlotPlan], windows: Windows) -> list[rrb.Container]:
    details = [
        _series_view(line, windows.history) for line in plan if line.plot.path.startswith(DETAILS)
    ]
    middle = [rrb.Grid(*details, grid_columns=2, name="Details")] if details else []
    return [_watch(plan, windows), *middle, _health(windows)]


def _watch(plan: Sequence[PlotPlan], windows: Windows) -> rrb.Container:
    by_path = {line.plot.path: line for line in plan}
    friction = [by_path[path] for path in quantities.FRICTION if path in by_path]
    right: list[rrb.Container | rrb.View] = [
        rrb.Horizontal(
            rrb.TextDocumentView(origin=at.ADVICE if plan else at.WAITING, name=at.ADVICE_VIEW),
            rrb.TextDocumentView(origin=at.STATUS, name=at.STATUS_VIEW),
            column_shares=[1, 1],
        ),
        _states_view(at.LANES, at.ALARMS_VIEW, windows),
        *(_series_view(line, windows.history) for line in friction),
        _log_view(at.LOG, at.LOG_VIEW),
    ]
    shares = [3.7, 2.3, *[1.65] * len(friction), 1.4]
    columns: list[rrb.Container] = [rrb.Vertical(*right, row_shares=shares)]
    if left := _signal_views(plan, windows):
        # The drive needs less room than the motion.
        columns.insert(0, rrb.Vertical(*left, row_shares=[4, *[5] * (len(left) - 1)]))
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
    """One view per signal, in the order of the table, others last; both accelerations in one."""
    order = [plot.path for plot in (*quantities.SAMPLE_PLOTS, *quantities.ESTIMATE_PLOTS)]
    shown = [
        line for line in plan if not line.plot.path.startswith((*quantities.FRICTION, DETAILS))
    ]
    shown.sort(key=lambda line: order.index(line.plot.path) if line.plot.path in order else 99)
    views: dict[str, rrb.View] = {}
    for line in shown:
        views.setdefault(line.title, _series_view(line, windows.signals))
    return list(views.values())


def _series_view(line: PlotPlan, window: float | None) -> rrb.View:
    pair = line.plot in (quantities.MEASURED, quantities.MODELLED)
    return rrb.TimeSeriesView(
        origin=quantities.ACCELERATION if pair else line.plot.path,
        name=line.title,
        axis_x=_time_axis(window),
        axis_y=rrb.ScalarAxis(range=line.range) if line.range else None,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=pair or len(line.plot.series) > 1),
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
    return rrb.Grid(*views, log, grid_columns=3, name="Health")
