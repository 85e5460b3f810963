"""Reports of the router on its own bus: health once a second, an event when access is refused."""

import threading
import time

from rigwatch.router.refusal_log import RefusalLog
from rigwatch.wire.bus import Bus, connect
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import EVENTS, HEALTH, Event, Health
from rigwatch.wire.rig_config import RigConfig

PROCESS = "router"
BETWEEN_HEALTH = 1.0
BETWEEN_EVENTS = 60.0
"""Shortest time between two events about refusals [s]."""


class RouterReport:
    """Publishes the figures of the router from a thread of its own, as a client of the router.

    Args:
        config: the rig's configuration, with keys.
        refusals: the counter.
        stop: ends the thread.
    """

    def __init__(self, config: RigConfig, refusals: RefusalLog, stop: threading.Event) -> None:
        self._config, self._refusals, self._stop = config, refusals, stop
        self._said = (0, 0)
        self._said_at = -BETWEEN_EVENTS
        self.reloads = 0
        self.trouble = ""

    def start(self) -> None:
        """Begin to report."""
        threading.Thread(target=self._run, name="router report", daemon=True).start()

    def _run(self) -> None:
        try:
            bus = connect(self._config, PROCESS)
        except RigwatchError as error:
            self.trouble = str(error)
            return
        while not self._stop.wait(BETWEEN_HEALTH):
            self.turn(bus, time.monotonic(), time.time_ns())
        bus.close()

    def turn(self, bus: Bus, now: float, t_ns: int) -> None:
        """Report once; `now` is monotonic time [s], `t_ns` Unix time [ns]."""
        counted = self._refusals.connections, self._refusals.messages
        counters = {
            "refused_connections": float(counted[0]),
            "denied_messages": float(counted[1]),
            "register_reloads": float(self.reloads),
        }
        bus.publish(HEALTH, Health(PROCESS, t_ns, "running", self.trouble, counters))
        if counted != self._said and now - self._said_at >= BETWEEN_EVENTS:
            connections, messages = counted[0] - self._said[0], counted[1] - self._said[1]
            self._said, self._said_at = counted, now
            text = f"{connections} connections and {messages} messages were refused"
            bus.publish(EVENTS, Event(PROCESS, t_ns, "warning", "ACCESS REFUSED", text))
