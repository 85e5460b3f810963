"""A study in the viewer: measured and modelled signals of every step and what is left, on one
timeline.

Nothing of the workbench is known here: what is drawn comes as plain columns.

    <output>/signals/measured, <output>/signals/<step>      [unit of the output]
    <output>/residual/<step>                                [unit of the output]
"""

import io
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from PIL import Image
from rerun.experimental import ViewerClient

from rigwatch.dashboard import palette
from rigwatch.dashboard.board import APPLICATION
from rigwatch.dashboard.viewer import Viewer, ViewerError
from rigwatch.wire.messages import FloatArray

TIMELINE = "recording"
_STORY = "story"
_FLUSH_TIMEOUT = 60.0
_ARRIVAL_TIMEOUT = 30.0
_SETTLING = 6.0
"""Until the viewer's own notices have gone from the screen [s]."""
_EMPTY_TOP = 36


@dataclass(frozen=True, eq=False)
class Output:
    """One output of a study's model.

    Attributes:
        name, unit: of the channel.
        measured: shape (n,); NaN where nothing valid was measured.
        modelled: by step, the first one the model alone, each of shape (n,).
    """

    name: str
    unit: str
    measured: FloatArray
    modelled: dict[str, FloatArray]


def draw_study(
    stream: rr.RecordingStream,
    seconds: FloatArray,
    outputs: Sequence[Output],
    story: str,
    *,
    bare: bool = False,
) -> int:
    """Draw a whole study; the number of samples.

    Args:
        stream: connected to a viewer or a file; is disconnected afterwards.
        seconds: time of the samples [s], shape (n,).
        outputs: what was measured and modelled then.
        story: the steps in words, as Markdown.
        bare: leave out what serves to operate the viewer, for pictures.
    """
    stream.send_blueprint(_blueprint(outputs, bare=bare))
    stream.log(_STORY, rr.TextDocument(story, media_type=rr.MediaType.MARKDOWN), static=True)
    for output in outputs:
        root = _path(output.name)
        _send(stream, f"{root}/signals/measured", seconds, output.measured, _look(0, "measured"))
        for k, (step, modelled) in enumerate(output.modelled.items(), 1):
            look, left = _look(k, step), output.measured - modelled
            _send(stream, f"{root}/signals/{_path(step)}", seconds, modelled, look)
            _send(stream, f"{root}/residual/{_path(step)}", seconds, left, look)
    stream.flush(timeout_sec=_FLUSH_TIMEOUT)
    stream.disconnect()
    return len(seconds)


def new_stream(name: str) -> rr.RecordingStream:
    """A recording of the viewer's, not connected to anything yet."""
    return rr.RecordingStream(APPLICATION, recording_id=name)


def take_picture(viewer: Viewer, seconds: float, path: Path) -> None:
    """Write what a headless viewer shows once it has data up to `seconds` [s].

    Raises:
        ViewerError: it does not get so far.
    """
    client = ViewerClient.connect(viewer.url)
    deadline = time.monotonic() + _ARRIVAL_TIMEOUT
    while _end_of(client) < seconds * 0.999:
        if time.monotonic() > deadline:
            raise ViewerError("the viewer did not take all data in time")
        time.sleep(0.1)
    time.sleep(_SETTLING)
    picture = Image.open(io.BytesIO(client.take_screenshot())).convert("RGB")
    picture = picture.crop((0, _EMPTY_TOP, *picture.size))
    picture.save(path, format="PNG", optimize=True)


def _end_of(client: ViewerClient) -> float:
    """Where the timeline ends [s]."""
    ends = [
        timeline.end or 0
        for recording in client.get_state().recordings
        for timeline in recording.timelines
        if timeline.name == TIMELINE
    ]
    return max(ends, default=0) * 1e-9


def _look(place: int, name: str) -> rr.SeriesLines:
    """Measured stands out behind everything; the steps have a colour each."""
    if place == 0:
        return rr.SeriesLines(colors=[palette.SIGNATURE], names=[name], widths=[3.0])
    colour = palette.OTHERS[(place - 1) % len(palette.OTHERS)]
    return rr.SeriesLines(colors=[colour], names=[name], widths=[1.3])


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


def _blueprint(outputs: Sequence[Output], *, bare: bool) -> rrb.Blueprint:
    views = [
        rrb.TimeSeriesView(
            origin=f"{_path(output.name)}/{kind}",
            name=f"{output.name}, {words} [{output.unit}]",
            plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
        )
        for output in outputs
        for kind, words in (("signals", "measured and modelled"), ("residual", "what is left"))
    ]
    story = rrb.TextDocumentView(origin=_STORY, name="Steps")
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(*views), story, column_shares=[7, 2]),
        rrb.TopPanel(state="hidden" if bare else "expanded"),
        rrb.TimePanel(state="hidden" if bare else "collapsed", timeline=TIMELINE),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )
