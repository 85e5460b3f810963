"""Says that a process lives and that samples go through it, in systemd's own notify protocol.

`rigwatch up` gives each process a datagram socket in `NOTIFY_SOCKET`, as systemd does, so that a
process speaks one protocol to whoever started it, and to nobody where it was started by hand.

    READY=1                 it has started
    WATCHDOG=1              samples advanced since the last word: only this feeds a watchdog
    X_RIGWATCH_COUNT=n      its loop turns, n samples went through since it started
    STATUS=text             one line for people
    STOPPING=1              it has begun to stop

A loop that turns without samples is alive but does not feed the watchdog: the supervisor sees the
difference between a process that hangs and one that waits for its source.
"""

import contextlib
import os
import socket
import time
from collections.abc import Callable, Mapping

INTERVAL = 0.25
"""Shortest time between two words to the supervisor [s]."""


class Heartbeat:
    """One process's word to its supervisor.

    Args:
        name: the process, such as "daq".
        environment: where `NOTIFY_SOCKET` is looked up.
        clock: seconds on a monotonic clock [s].
    """

    def __init__(
        self,
        name: str,
        environment: Mapping[str, str] = os.environ,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name = name
        self._clock = clock
        self._address = _address(environment.get("NOTIFY_SOCKET", ""))
        self._socket: socket.socket | None = None
        self._said_at = -INTERVAL
        self._said_count = 0
        if self._address:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)

    def ready(self, status: str = "running") -> None:
        """The process has started: its device, bus or file is open."""
        self._say(f"READY=1\nSTATUS={status}\nX_RIGWATCH_COUNT={self._said_count}")

    def advance(self, count: int) -> None:
        """The loop has turned; `count` samples have gone through since the start.

        To be called at every turn, also where `count` has not grown. Costs a clock reading.
        """
        now = self._clock()
        if self._socket is None or now - self._said_at < INTERVAL:
            return
        fed = "WATCHDOG=1\n" if count > self._said_count else ""
        self._said_at, self._said_count = now, count
        self._say(f"{fed}X_RIGWATCH_COUNT={count}")

    def status(self, text: str) -> None:
        """One line for people, such as "reconnecting to the device"."""
        self._say(f"STATUS={text}")

    def stopping(self) -> None:
        """The process has begun to stop in good order."""
        self._say("STOPPING=1")

    def _say(self, text: str) -> None:
        # A supervisor that is gone or slow must never stop the process that it watches.
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(text.encode(), self._address)


def _address(path: str) -> str:
    """The socket's address; a leading @ stands for the abstract namespace."""
    return "\0" + path[1:] if path.startswith("@") else path
