"""Reports of the router on its own bus: health once a second, events.

ACCESS REFUSED      somebody was refused
CERTIFICATES END    once a day, from a month before one of them ends
"""

import contextlib
import logging
import math
import threading
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

from rigwatch.router.refusal_log import RefusalLog
from rigwatch.wire.access import days_left, ending_soon, endings_text, in_force, read_register
from rigwatch.wire.bus import Bus, joined
from rigwatch.wire.errors import KeysError, RigwatchError
from rigwatch.wire.messages import EVENTS, HEALTH, Event, Health
from rigwatch.wire.rig_config import RigConfig

_log = logging.getLogger(__name__)

PROCESS = "router"
BETWEEN_HEALTH = 1.0
BETWEEN_EVENTS = 60.0
"""Shortest time between two events about refusals [s]."""
BETWEEN_LOOKS, DAY = 60.0, 86_400.0
"""Time between two checks of the certificates' ends, and between two events about them [s]."""
LEAVING = 5.0
"""Longest wait for the thread's end: it leaves the bus, or gives up an attempt to join it [s]."""


class RouterReport:
    """Publishes the figures of the router from a thread of its own, as a client of the router.

    Args:
        config: the rig's configuration.
        refusals: the counter.
        stop: ends the thread.
    """

    def __init__(self, config: RigConfig, refusals: RefusalLog, stop: threading.Event) -> None:
        self._config, self._refusals, self._stop = config, refusals, stop
        self._thread = threading.Thread(target=self._run, name="router report", daemon=True)
        self._said = (0, 0)
        self._said_at = -BETWEEN_EVENTS
        self._looked_at = self._warned_at = -math.inf
        self._days = math.inf
        self.reloads = 0
        self.trouble = ""

    def start(self) -> None:
        """Begin to report."""
        self._thread.start()

    def finish(self) -> None:
        """Wait for the thread's end after `stop`: one within Zenoh would abort the process."""
        if self._thread.ident is not None:
            self._thread.join(LEAVING)

    def _run(self) -> None:
        try:
            with joined(self._config, PROCESS, self._stop) as bus:
                while bus is not None and not self._stop.wait(BETWEEN_HEALTH):
                    self.turn(bus, time.monotonic(), time.time_ns())
        except RigwatchError as error:
            _log.warning("the router reports nothing: %s", error)

    def turn(self, bus: Bus, now: float, t_ns: int) -> None:
        """Report once; `now` is monotonic time [s], `t_ns` Unix time [ns]."""
        counted = self._refusals.connections, self._refusals.messages
        counters = {
            "refused_connections": float(counted[0]),
            "denied_messages": float(counted[1]),
            "register_reloads": float(self.reloads),
        }
        for event in self._endings(now, t_ns):
            bus.publish(EVENTS, event)
        if math.isfinite(self._days):
            counters["certificate_days"] = self._days
        bus.publish(HEALTH, Health(PROCESS, t_ns, "running", self.trouble, counters))
        if counted != self._said and now - self._said_at >= BETWEEN_EVENTS:
            connections, messages = counted[0] - self._said[0], counted[1] - self._said[1]
            self._said, self._said_at = counted, now
            text = f"{connections} connections and {messages} messages were refused"
            bus.publish(EVENTS, Event(PROCESS, t_ns, "warning", "ACCESS REFUSED", text))

    def _endings(self, now: float, t_ns: int) -> Iterator[Event]:
        """Look when the certificates end, and warn of those that end soon."""
        keys = self._config.bus.security.keys
        if not keys or now - self._looked_at < BETWEEN_LOOKS:
            return
        self._looked_at = now
        with contextlib.suppress(KeysError):  # the follower of the register reports it
            register = read_register(Path(keys))
            today = datetime.fromtimestamp(t_ns / 1e9, UTC).date()
            left = [days_left(one, today) for one in in_force(register)]
            self._days = float(min(left, default=math.inf))
            soon = ending_soon(register, today)
            if soon and now - self._warned_at >= DAY:
                self._warned_at = now
                yield Event(PROCESS, t_ns, "error", "CERTIFICATES END", endings_text(soon))
