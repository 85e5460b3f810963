"""Heartbeat outputs: a file and a URL, renewed while the monitor publishes estimates.

Another watchdog raises an alarm when they stop, whatever ended: monitor, witness or the machine.
"""

import threading
from pathlib import Path

from rigwatch.wire.errors import ConfigError, reason_of
from rigwatch.wire.host import replace_file
from rigwatch.witness.addresses import Bounded, why_not

TIMEOUT = 5.0
"""Longest wait for each part of the answer to a ping [s]."""
WHOLE = 10.0
"""Longest ping [s]."""


def write_beat(path: Path, rig: str, t_ns: int) -> str:
    """Renew the heartbeat file, whose age shows when the monitor last published.

    Returns:
        why it cannot be written; "" if it is.
    """
    try:
        replace_file(path, f"{t_ns / 1e9:.3f} {rig} running\n", durable=False)
    except OSError as error:
        return f"heartbeat file {path} cannot be written: {reason_of(error)}"
    return ""


class Pinger:
    """Requests a URL at intervals, in a thread of its own.

    Args:
        url: http or https, as a dead man's switch offers.
        interval: shortest time between two pings [s].

    Attributes:
        sent, failed: number of pings answered with success, and of others.
        trouble: why the last one failed, in one line without the address, which may be a secret; ""
            if it did not.

    Raises:
        ConfigError: the URL is of another kind.
    """

    def __init__(self, url: str, interval: float) -> None:
        if not url.startswith(("http://", "https://")):
            kind = url.partition(":")[0]
            raise ConfigError("configuration", "witness.heartbeat_url", kind, "http:// or https://")
        self.sent = self.failed = 0
        self.trouble = ""
        self._bounded = Bounded("ping")
        self._url, self._interval = url, interval
        self._due_at = float("-inf")
        self._wanted = threading.Event()
        threading.Thread(target=self._run, name="ping", daemon=True).start()

    def beat(self, now: float) -> None:
        """Ping if it is due; never waits. `now` is monotonic time [s]."""
        if now >= self._due_at:
            self._due_at = now + self._interval
            self._wanted.set()

    def _run(self) -> None:
        while self._wanted.wait():
            self._wanted.clear()
            why = self._ping()
            self.trouble = why and f"heartbeat_url cannot be reached: {why}"
            if why:
                self.failed += 1
            else:
                self.sent += 1

    def _ping(self) -> str:
        """Ping; returns why it failed, "" if it did not."""
        found = ["no answer"]
        try:
            self._bounded.call(lambda: found.append(why_not(self._url, TIMEOUT)), WHOLE)
        except TimeoutError as error:
            return str(error)
        return found[-1]
