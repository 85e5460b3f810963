"""Draws the feed into one viewer, in a thread of its own: a viewer that hangs blocks its writer.

A drawer lives as long as its viewer. The next one continues with the same facts, so that a verdict
survives the viewer in which it was shown.
"""

import copy
import threading
import time
from dataclasses import replace

import rerun as rr

from rigwatch.dashboard.board import APPLICATION, Dashboard, Facts
from rigwatch.dashboard.feed import Feed

_FLUSH_TIMEOUT = 5.0
_SHELF_EVERY = 5.0
"""Time between questions for the shelved alarms [s]."""
LEAST = 10.0
"""Shortest recording before another one is begun [s]: two sources may send in turns."""


class Drawer:
    """Reads the feed at a steady rate and draws.

    Args:
        feed: source of messages.
        url: address of the viewer.
        facts: known facts.
        rate: updates per second [Hz].
    """

    def __init__(self, feed: Feed, url: str, facts: Facts, rate: float) -> None:
        self._feed, self._url, self._period = feed, url, 1.0 / rate
        self.facts = copy.deepcopy(facts)
        self.failure: Exception | None = None
        self._turned_at = time.monotonic()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="drawer", daemon=True)
        self._thread.start()

    @property
    def held_for(self) -> float:
        """Time since the last completed update [s]; large if the viewer accepts no data."""
        return time.monotonic() - self._turned_at

    def stop(self, patience: float = 2.0) -> None:
        """Ask it to end; one blocked by a viewer ends with that viewer."""
        self._stop.set()
        self._thread.join(patience)

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                self._draw()
        except Exception as error:
            self.failure = error

    def _draw(self) -> None:
        """Draw one recording: until asked to end, or until the clock was set back."""
        began = time.monotonic()
        stream = rr.RecordingStream(APPLICATION, recording_id=f"{self.facts.rig}-{time.time_ns()}")
        stream.connect_grpc(self._url)
        dashboard = Dashboard(stream, self.facts)
        now_ns = time.time_ns()
        for alarm in self._feed.standing() or self.facts.book.standing():
            dashboard.show(replace(alarm, t_ns=min(alarm.t_ns, now_ns)))
        ask_at = 0.0
        while not self._stop.wait(max(0.0, self._period - self.held_for)):
            self._turned_at = time.monotonic()
            if self._turned_at >= ask_at:
                # Without a monitor that answers nothing has left the shelf.
                if (shelf := self._feed.shelf()) is not None:
                    self.facts.shelf = shelf
                ask_at = time.monotonic() + _SHELF_EVERY
            for message in self._feed.drain():
                dashboard.show(message)
            self.facts.skipped, self.facts.lost_alarms = self._feed.skipped, self._feed.lost_alarms
            dashboard.flush(time.time_ns())
            # Waiting for each update's data bounds the backlog of a viewer that accepts none.
            stream.flush(timeout_sec=_FLUSH_TIMEOUT)
            if dashboard.set_back and time.monotonic() - began > LEAST:
                break
        stream.disconnect()
