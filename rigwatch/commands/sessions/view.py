"""`rigwatch view`: shows a recording on the screen of a live rig."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import add_span, print_json
from rigwatch.commands.sessions.session_messages import (
    length_of,
    messages_of,
    model_for,
    rig_of,
)

if TYPE_CHECKING:
    from rigwatch.dashboard.recording import Drawn

HELP = "show a recording: signals, residual, friction estimates, alarms and guidance"
EXAMPLE = """  rigwatch view sessions/bench1-20260501T120000Z
  rigwatch view sessions/bench1-20260501T120000Z --start 60 --end 120 --save minute.rrd"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("session", type=Path, help="session file or folder of segments")
    parser.add_argument(
        "--model",
        type=Path,
        help="compute estimates and alarms with this model; default: show the recorded ones",
    )
    add_span(parser)
    parser.add_argument("--save", type=Path, metavar="FILE", help="write a file for Rerun (.rrd)")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="write a picture (.png)")
    parser.add_argument(
        "--viewer", choices=("auto", "native", "web"), default="auto", help="kind of viewer"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if it is drawn; returns once a window is closed."""
    from rigwatch.commands.common import ready_to_draw, say
    from rigwatch.wire.session import open_session

    ready_to_draw(arguments.save, arguments.picture)
    open_session(arguments.session)  # reports a wrong file before a window opens
    drawn = _shown(arguments, _silent if arguments.json else say)
    if arguments.json and drawn:
        print_json(drawn)
    return 0


def _silent(_: str) -> None:
    """Print nothing but JSON."""


def _shown(arguments: argparse.Namespace, say: Callable[[str], None]) -> "Drawn | None":
    from rigwatch.dashboard import recording

    if arguments.picture:
        viewer = recording.headless_viewer()
        try:
            drawn = _draw(arguments, say, viewer.url)
            recording.point_cursor(viewer.url, drawn.cursor_ns())
            recording.take_picture(viewer, arguments.picture)
        finally:
            viewer.stop()
        return drawn
    if arguments.save:
        return _draw(arguments, say, "")
    return _in_a_viewer(arguments, say)


def _in_a_viewer(arguments: argparse.Namespace, say: Callable[[str], None]) -> "Drawn | None":
    """Show it until the window is closed; None if interrupted while drawing."""
    from rigwatch.commands.common import show_until_closed
    from rigwatch.dashboard import recording
    from rigwatch.dashboard.viewer import ForeignViewer, Viewer

    drawn: Drawn | None = None

    def draw(viewer: Viewer | ForeignViewer) -> str:
        nonlocal drawn
        drawn = _draw(arguments, say, viewer.url)
        if isinstance(viewer, Viewer) and viewer.kind == "native":
            recording.point_cursor(viewer.url, drawn.cursor_ns())
        return f"{drawn.samples} samples shown"

    show_until_closed(arguments.viewer, draw, say)
    return drawn


def _draw(arguments: argparse.Namespace, say: Callable[[str], None], url: str) -> "Drawn":
    """Draw the session into the viewer at `url`, or into the given file."""
    from rigwatch.commands.common import marks_of, span_of
    from rigwatch.dashboard import recording
    from rigwatch.dashboard.board import Facts
    from rigwatch.dashboard.drawn_to import drawn_to
    from rigwatch.wire.session import open_session

    session = open_session(arguments.session)
    span = span_of(arguments, session)
    model, compute = model_for(session, span, arguments.model)
    facts = Facts(rig_of(session))
    if model is not None:
        facts.model, facts.marks = model.name, marks_of(model)
    windows = recording.windows_for(length_of(session, span))
    messages = messages_of(session, span, model if compute else None)
    bare = arguments.picture is not None
    with drawn_to(session.path.stem, url, arguments.save) as stream:
        return recording.draw(
            messages, stream, facts, windows, lambda n: say(f"{n} samples drawn"), bare=bare
        )
