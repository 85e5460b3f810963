"""A study in the viewer: measured and modelled signals and the residual of every step, on one
timeline; for a structure monitored for damage also the test of the residual.

Independent of workbench and structures: the data come as plain columns.

    <output>/signals/measured, <output>/signals/<step>      [unit of the output]
    <output>/residual/<step>, <output>/residual/<bound>     [unit of the output]
    test/statistic, test/threshold, test/<instant>          [share of the threshold]
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.experimental import ViewerClient

from rigwatch.dashboard.board import palette, screen
from rigwatch.dashboard.viewer import Viewer, await_data, save_picture
from rigwatch.wire.arrays import FloatArray

TIMELINE = "recording"
_STORY, _TEST = "story", "test"
_SHOWN = 3
"""Number of outputs on the first tab; the others are on a second one."""
_TALL = 3.0
"""Upper end of the test's axis, in thresholds."""
_FLUSH_TIMEOUT = 60.0


@dataclass(frozen=True, eq=False)
class Output:
    """One output of a study's model.

    Attributes:
        name, unit: of the channel.
        measured: shape (n,); NaN where nothing valid was measured.
        modelled: by step, the first being the model alone, each of shape (n,).
        bound: name and size of a significant residual, None if there is none.
    """

    name: str
    unit: str
    measured: FloatArray
    modelled: dict[str, FloatArray]
    bound: tuple[str, float] | None = None


@dataclass(frozen=True, eq=False)
class Judged:
    """The test of the residual.

    Attributes:
        statistic: statistic over its threshold, shape (n,); NaN where not tested.
        instants: times of events [s], by name.
    """

    statistic: FloatArray
    instants: dict[str, float]


def draw_study(
    stream: rr.RecordingStream,
    seconds: FloatArray,
    outputs: Sequence[Output],
    story: str,
    *,
    judged: Judged | None = None,
    bare: bool = False,
) -> int:
    """Draw a whole study; the number of samples.

    Args:
        stream: connected to a viewer or a file; disconnected afterwards.
        seconds: time of the samples [s], shape (n,).
        outputs: measured and modelled signals, the most telling first.
        story: the steps as Markdown text.
        judged: the test for damage, if there was one.
        bare: hide the controls of the viewer, for pictures.
    """
    stream.send_blueprint(_blueprint(outputs, judged, bare=bare))
    stream.log(_STORY, rr.TextDocument(story, media_type=rr.MediaType.MARKDOWN), static=True)
    for output in outputs:
        _draw_output(stream, seconds, output)
    if judged:
        _draw_test(stream, seconds, judged)
    stream.flush(timeout_sec=_FLUSH_TIMEOUT)
    stream.disconnect()
    return len(seconds)


def _draw_output(stream: rr.RecordingStream, seconds: FloatArray, output: Output) -> None:
    root = _path(output.name)
    _send(stream, f"{root}/signals/measured", seconds, output.measured, _look(0, "measured"))
    for k, (step, modelled) in enumerate(output.modelled.items(), 1):
        look, left = _look(k, step), output.measured - modelled
        _send(stream, f"{root}/signals/{_path(step)}", seconds, modelled, look)
        _send(stream, f"{root}/residual/{_path(step)}", seconds, left, look)
    if output.bound:
        name, size = output.bound
        ends, sides = seconds[[0, -1]], (("", size), (" below", -size))
        for side, level in sides:
            entity = f"{root}/residual/{_path(name + side)}"
            _send(stream, entity, ends, np.full(2, level), _limit(name))


def _draw_test(stream: rr.RecordingStream, seconds: FloatArray, judged: Judged) -> None:
    # Averaged over pixels, as the viewer does unless told, an alarm would stay below its threshold.
    statistic = _look(1, "statistic", rr.components.AggregationPolicy.Max)
    _send(stream, f"{_TEST}/statistic", seconds, judged.statistic, statistic)
    _send(stream, f"{_TEST}/threshold", seconds[[0, -1]], np.ones(2), _limit("threshold"))
    for k, (name, at) in enumerate(judged.instants.items(), 2):
        upright, look = np.array([0.0, _TALL]), _look(k, name, rr.components.AggregationPolicy.Off)
        _send(stream, f"{_TEST}/{_path(name)}", np.full(2, at), upright, look)


def take_picture(viewer: Viewer, seconds: float, path: Path) -> None:
    """Write what a headless viewer shows once it has data up to `seconds` [s].

    Raises:
        ViewerError: it does not receive them in time.
    """
    client = ViewerClient.connect(viewer.url)
    await_data(client, TIMELINE, seconds * 0.999e9)
    save_picture(client, path)


def _look(
    place: int,
    name: str,
    policy: rr.components.AggregationPolicy = rr.components.AggregationPolicy.Average,
) -> rr.SeriesLines:
    """The measurement is drawn behind everything; each step has a colour."""
    colour = palette.OTHERS[(place - 1) % len(palette.OTHERS)] if place else palette.SIGNATURE
    width = 1.3 if place else 3.0
    return rr.SeriesLines(colors=[colour], names=[name], widths=[width], aggregation_policy=policy)


def _limit(name: str) -> rr.SeriesLines:
    return rr.SeriesLines(colors=[palette.LIMIT], names=[name], widths=[1.3])


def _send(
    stream: rr.RecordingStream,
    entity: str,
    seconds: FloatArray,
    values: FloatArray,
    look: rr.SeriesLines,
) -> None:
    good = np.isfinite(values)
    stream.log(entity, look, static=True)
    stream.send_columns(
        entity,
        indexes=[rr.TimeColumn(TIMELINE, duration=seconds[good])],
        columns=rr.Scalars.columns(scalars=values[good]),
    )


def _path(name: str) -> str:
    return "_".join(name.replace("+", " ").split())


def _blueprint(outputs: Sequence[Output], judged: Judged | None, *, bare: bool) -> rrb.Blueprint:
    test = [_test_view()] if judged else []
    first, others = _views(outputs[:_SHOWN]), _views(outputs[_SHOWN:])
    plots: rrb.Vertical | rrb.Tabs = rrb.Vertical(*test, *first, name="Signals")
    if others:
        plots = rrb.Tabs(plots, rrb.Vertical(*others, name="Other signals"))
    story = rrb.TextDocumentView(origin=_STORY, name="In words")
    content = rrb.Horizontal(plots, story, column_shares=[7, 2])
    return screen(content, TIMELINE, bare=bare)


def _views(outputs: Sequence[Output]) -> list[rrb.TimeSeriesView]:
    return [
        rrb.TimeSeriesView(
            origin=f"{_path(output.name)}/{kind}",
            name=f"{output.name}, {words} [{output.unit}]",
            plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
        )
        for output in outputs
        for kind, words in (("signals", "measured and modelled"), ("residual", "what is left"))
    ]


def _test_view() -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin=_TEST,
        name="Test of what is left, over its threshold",
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
        axis_y=rrb.ScalarAxis(range=(0.0, _TALL)),
    )
