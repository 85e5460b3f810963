"""The dashboard's process: feed, drawer and viewer, and the restart of a lost viewer.

    bus ──▶ Feed ──▶ Drawer (thread) ──▶ viewer (process)
                        this loop monitors both and reports

Nothing waits for the dashboard: its queues are bounded and it sends no requests. A viewer that dies
or accepts no data is restarted; a window closed by its user ends the process.
"""

import threading
import time
from collections.abc import Callable

from rigwatch.dashboard.board import Facts
from rigwatch.dashboard.drawer import Drawer
from rigwatch.dashboard.feed import Feed
from rigwatch.dashboard.viewer import Choice, ForeignViewer, Viewer, ViewerError, open_viewer
from rigwatch.wire.bus import Bus
from rigwatch.wire.host import Heartbeat, waits_for_samples
from rigwatch.wire.messages import HEALTH, Health
from rigwatch.wire.rig_config import DashboardSection

_TURN = 0.2
_HEALTH_PERIOD = 1.0
_HELD_TOO_LONG = 10.0
_LAST_MOMENT = 1.0
_RESTARTS, _WITHIN = 5, 60.0


class LiveDashboard:
    """One rig's screen, live.

    Args:
        bus: the rig's bus.
        settings: section [dashboard] of the configuration.
        choice: which viewer.
        say: called with messages for people.
        stop: ends `run` when set.

    Attributes:
        viewer: the viewer in use, None before the first.
        facts: known facts, kept between viewers.
    """

    def __init__(
        self,
        bus: Bus,
        settings: DashboardSection,
        choice: Choice,
        say: Callable[[str], None],
        stop: threading.Event,
    ) -> None:
        self.stop = stop
        self.viewer: Viewer | ForeignViewer | None = None
        self.facts = Facts(bus.rig)
        self._bus, self._settings, self._choice, self._say = bus, settings, choice, say
        self._feed = Feed(bus)
        self._heartbeat = Heartbeat("dashboard")
        self._ends: list[float] = []
        self._told_at = 0.0

    def run(self) -> None:
        """Show the rig until stopped, or until the user closes the window.

        Raises:
            ViewerError: no viewer can be started, or it dies again and again.
        """
        try:
            while not self.stop.is_set() and (reason := self._show()):
                self._say(reason)
                self._count_end(reason)
        finally:
            self._heartbeat.stopping()
            self._feed.close()

    def _show(self) -> str:
        """Run one viewer; returns why another one is needed, empty if none is."""
        self.viewer = open_viewer(
            self._choice, self._settings, self.stop, self._say, self._tell_supervisor
        )
        if self.viewer is None:
            return ""
        self._heartbeat.ready()
        drawer = Drawer(self._feed, self.viewer.url, self.facts, self._settings.update_rate)
        try:
            return self._watch(self.viewer, drawer)
        finally:
            drawer.stop()
            self.viewer.stop()
            self.facts = drawer.facts

    def _watch(self, viewer: Viewer | ForeignViewer, drawer: Drawer) -> str:
        while not self.stop.wait(_TURN):
            self.facts = drawer.facts
            self._tell_supervisor()
            self._tell_rig()
            code = viewer.exit_code()
            if code is None and drawer.failure is not None:
                # A viewer that dies closes the connection first: report its end, not that.
                self.stop.wait(_LAST_MOMENT)
                code = viewer.exit_code()
            if code == 0:
                self._say("the viewer was closed: the dashboard ends")
                return ""
            if code is not None:
                return "the viewer has died and is opened again"
            if drawer.failure is not None:
                return f"drawing failed and begins again: {drawer.failure}"
            if drawer.held_for > _HELD_TOO_LONG:
                return "the viewer takes no data and is opened again"
        return ""

    def _tell_supervisor(self) -> None:
        waits = waits_for_samples(connected=self._bus.connected())
        self._heartbeat.advance(self.facts.samples, waits)

    def _tell_rig(self) -> None:
        """The dashboard's own health, once a second."""
        if time.monotonic() - self._told_at < _HEALTH_PERIOD:
            return
        self._told_at = time.monotonic()
        counters = {
            "drawn_samples": float(self.facts.samples),
            "skipped_messages": float(self._feed.skipped),
            "viewer_restarts": float(len(self._ends)),
        }
        health = Health("dashboard", time.time_ns(), "running", "", counters)
        self._bus.publish(HEALTH, health)

    def _count_end(self, reason: str) -> None:
        """Give up on a viewer that ends repeatedly; wait for an external one instead."""
        now = time.monotonic()
        self._ends.append(now)
        recent = [end for end in self._ends if now - end < _WITHIN]
        if self._choice != "connect" and len(recent) > _RESTARTS:
            raise ViewerError(f"{len(recent)} times in {_WITHIN:.0f} s: {reason}")
