"""Shared parts of commands that draw: requirements, and a viewer that stays until closed."""

import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common.output import check_folder

if TYPE_CHECKING:
    from rigwatch.dashboard.viewer import Choice, ForeignViewer, Viewer

_LOOK_AGAIN = 0.3


def ready_to_draw(*files: Path | None) -> None:
    """Check early that drawing is possible, also into these files.

    Raises:
        MissingExtraError: Rerun is not installed.
        SessionError: a file's folder does not exist.
    """
    from rigwatch.dashboard import require_rerun

    require_rerun()
    for file in files:
        check_folder(file)
    os.environ.setdefault("RUST_LOG", "off")


def show_until_closed(
    choice: "Choice", draw: "Callable[[Viewer | ForeignViewer], str]", say: Callable[[str], None]
) -> None:
    """Open a viewer and draw; it stays until its window is closed or the command is interrupted.

    Args:
        choice: which viewer.
        draw: draws into it, and returns what is shown.
        say: called with messages for people.
    """
    from rigwatch.dashboard.viewer import RECORDING_MEMORY, open_viewer
    from rigwatch.wire.rig_config import DashboardSection

    stop = threading.Event()
    viewer = open_viewer(
        choice, DashboardSection(), stop, say, lambda: None, memory=RECORDING_MEMORY
    )
    assert viewer is not None  # only the wait for an external viewer can be interrupted
    try:
        say(f"{draw(viewer)}; Ctrl-C ends")
        while viewer.exit_code() is None:
            stop.wait(_LOOK_AGAIN)
    except KeyboardInterrupt:
        say("")
    finally:
        viewer.stop()
