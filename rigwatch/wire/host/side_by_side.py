"""Several rigs in one process, each in its own thread: none waits for another.

    rig a ──advance──▶ Part ─┐
    rig b ──advance──▶ Part ─┴─ sum ─▶ heartbeat of the process

A rig whose work fails is restarted after a while, as its process would be. A loop that hangs, in a
device that never answers, is reported; the others continue. A renewal restarts the rigs whose
configuration has changed, and only those.
"""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from typing import Protocol

from rigwatch.wire.errors import line_about
from rigwatch.wire.host.heartbeat import Heartbeat, waits_of

BEAT = 0.2
"""Time between two checks of the rigs [s]."""
HANGS_AFTER = 5.0
"""Time without a turn of a rig's loop after which that is reported [s]."""
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0
"""Pauses before a rig that failed starts anew [s]."""
START_PATIENCE = 10.0
"""Longest wait for a further rig to begin before the process counts as ready [s]."""
STOP_PATIENCE = 5.0
"""Longest wait for a further one of the rigs' loops to end [s]."""
LONGEST_STOP = 40.0
"""Longest wait for all of them: hundreds of recordings end one after the other [s]."""
_NOTHING = object()
_log = logging.getLogger(__name__)


class Pulse(Protocol):
    """What a loop reports: to the supervisor, or as a part of a process of several rigs."""

    def ready(self, status: str = "running") -> None:
        """The loop begins."""

    def advance(self, count: int, waits: str = "") -> None:
        """A turn is over; `count` samples have passed since the loop began; what it waits for."""

    def stopping(self) -> None:
        """The loop has ended."""


class RigPulse(Pulse, Protocol):
    """That of one rig among several."""

    def say(self, text: str) -> None:
        """Tell people a line about this rig."""


Work = Callable[[threading.Event, RigPulse], None]
"""The work of a rig until the event is set."""


class Part:
    """One rig of a process.

    Args:
        name: the rig's, for remarks.
        work: called in the rig's thread, again after it failed.
        version: what the work depends on, such as a configuration; raises if it is wrong.
        say: called with remarks for people.

    Attributes:
        settled: whether its loop has begun, or has failed to.
        waits: what it waits for, if that is no fault of this process.
    """

    def __init__(
        self,
        name: str,
        work: Work,
        version: Callable[[], object] = lambda: None,
        say: Callable[[str], None] = _log.warning,
    ) -> None:
        self.settled, self.waits = False, ""
        self._name, self._work, self._out = name, work, say
        self._version, self._taken = version, _NOTHING
        self._stop, self._ended = threading.Event(), False
        self._before = self._now = 0
        self._pause = FIRST_PAUSE
        self._turned_at: float | None = None
        self._hangs = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def count(self) -> int:
        """Samples of all runs so far."""
        return self._before + self._now

    def ready(self, status: str = "running") -> None:  # noqa: ARG002 (a process has one status)
        """See `Pulse`."""
        self.settled = True
        self._turned_at = time.monotonic()

    def advance(self, count: int, waits: str = "") -> None:
        """See `Pulse`."""
        self._turned_at, self.waits = time.monotonic(), waits
        if count > self._now:
            self._now, self._pause = count, FIRST_PAUSE

    def stopping(self) -> None:
        """See `Pulse`."""
        self._turned_at = None

    def say(self, text: str) -> None:
        """See `RigPulse`."""
        self._out(f"{self._name}: {text}")

    def check(self) -> None:
        """Report a loop that hangs, and one that runs again."""
        at = self._turned_at
        hangs = at is not None and time.monotonic() - at > HANGS_AFTER
        if hangs != self._hangs:
            self._hangs = hangs
            how = f"hangs: no turn for {HANGS_AFTER:g} s" if hangs else "goes on"
            self.say(how)

    def renew(self) -> None:
        """Start the work anew if what it depends on has changed, and is right."""
        try:
            changed = self._version() != self._taken
        except Exception as error:  # the rig keeps running with what it has
            self._out(f"{line_about(self._name, error)}; goes on as before")
            return
        if changed:
            self._stop.set()

    def stop(self) -> None:
        """Ask the work to end."""
        self._ended = True
        self._stop.set()

    def has_ended(self, timeout: float) -> bool:
        """Whether it has ended, after up to `timeout` [s]."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while not self._ended:
            try:
                self._taken = self._version()
                self._work(self._stop, self)
            except Exception as error:  # whatever is wrong with one rig, the others continue
                self._failed(error)
            self._before, self._now, self._turned_at = self.count, 0, None
            if not self._ended:
                self._stop.clear()

    def _failed(self, error: Exception) -> None:
        self._turned_at, self.settled = None, True
        self._out(f"{line_about(self._name, error)}; starts anew in {self._pause:.0f} s")
        self._stop.wait(self._pause)
        self._pause = min(2 * self._pause, LONGEST_PAUSE)


def run_side_by_side(
    parts: Sequence[Part], heartbeat: Heartbeat, stop: threading.Event, renew: threading.Event
) -> None:
    """Watch over the rigs until `stop` is set, then end them.

    Args:
        parts: the rigs.
        heartbeat: of the process.
        stop: ends the loop.
        renew: when set, rigs whose configuration has changed start anew; it is cleared.
    """
    ready, settled, settled_at = False, 0, time.monotonic()
    while not stop.wait(BEAT):
        before, settled = settled, sum(part.settled for part in parts)
        if settled > before:
            settled_at = time.monotonic()
        waited = time.monotonic() - settled_at
        if not ready and (settled == len(parts) or waited > START_PATIENCE):
            ready = True
            heartbeat.ready(f"{len(parts)} rigs")
        if renew.is_set():
            renew.clear()
            for part in parts:
                part.renew()
        for part in parts:
            part.check()
        heartbeat.advance(sum(part.count for part in parts), waits_of(p.waits for p in parts))
    heartbeat.stopping()
    for part in parts:
        part.stop()
    _wait_for_ends(parts, heartbeat)


def _wait_for_ends(parts: Sequence[Part], heartbeat: Heartbeat) -> None:
    """Wait for the rigs' loops to end, as long as one of them does now and then."""
    began = ended_at = time.monotonic()
    running = list(parts)
    while running and time.monotonic() < min(ended_at + STOP_PATIENCE, began + LONGEST_STOP):
        running[0].has_ended(BEAT)
        left = [part for part in running if not part.has_ended(0.0)]
        if len(left) < len(running):
            ended_at = time.monotonic()
            heartbeat.still_stopping(STOP_PATIENCE)
        running = left
