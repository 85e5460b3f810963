"""Chooses the viewer: a window if there is a display, else a page for a local browser."""

import threading
from collections.abc import Callable
from typing import Literal

from rigwatch.dashboard.viewer.viewer import (
    LIVE_MEMORY,
    ForeignViewer,
    Kind,
    Memory,
    Viewer,
    ViewerError,
    answers,
    has_display,
)
from rigwatch.wire.rig_config import DashboardSection

Choice = Literal["auto", "native", "web", "connect", "headless"]
_LOOK_AGAIN = 0.5


def open_viewer(
    choice: Choice,
    settings: DashboardSection,
    stop: threading.Event,
    say: Callable[[str], None],
    tick: Callable[[], None],
    *,
    memory: Memory = LIVE_MEMORY,
) -> Viewer | ForeignViewer | None:
    """A viewer that accepts data; None if stopped while waiting for one.

    Args:
        choice: "auto", a kind of viewer, or "connect" for one that is already running.
        settings: ports.
        stop: ends the wait.
        say: called with messages for people.
        tick: called a few times a second while waiting.
        memory: memory limits.

    Raises:
        ViewerError: none can be started.
    """
    if choice == "connect":
        return _wait_for(settings.grpc_port, stop, say, tick)
    if choice != "auto":
        return _start(choice, settings, say, tick, memory)
    if has_display():
        try:
            return _start("native", settings, say, tick, memory)
        except ViewerError as error:
            say(f"{error}; a web page takes the window's place")
    return _start("web", settings, say, tick, memory)


def _start(
    kind: Kind,
    settings: DashboardSection,
    say: Callable[[str], None],
    tick: Callable[[], None],
    memory: Memory,
) -> Viewer:
    # A browser's address should stay the same; a window may use any data port.
    port = settings.grpc_port if kind == "web" or not answers(settings.grpc_port) else 0
    viewer = Viewer(kind, port, settings.web_port, memory).await_answer(tick)
    if kind == "web":
        say(f"no page opens by itself: open {viewer.web_url} in a browser on this machine")
    return viewer


def _wait_for(
    port: int, stop: threading.Event, say: Callable[[str], None], tick: Callable[[], None]
) -> ForeignViewer | None:
    if not answers(port):
        say(f"waiting for a viewer at port {port}: start one with `rerun --port {port}`")
    while not answers(port):
        tick()
        if stop.wait(_LOOK_AGAIN):
            return None
    return ForeignViewer(port)
