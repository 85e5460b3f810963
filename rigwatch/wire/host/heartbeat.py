"""Reports liveness and progress of a process in systemd's notify protocol.

`rigwatch up` gives each process a datagram socket in `NOTIFY_SOCKET`, as systemd does, so that a
process uses one protocol for either parent, and none if it was started by hand.

    READY=1                 it has started
    WATCHDOG=1              samples advanced since the last notification, or there are none to come
    X_RIGWATCH_COUNT=n      its loop runs; n samples passed since it started
    STATUS=text             one line for people
    STOPPING=1              it is stopping
    EXTEND_TIMEOUT_USEC=5   it goes on to do so, and is not to be killed for this time [µs]

A loop that runs without samples is alive but feeds the watchdog only if it says what it waits for:
to start it again would bring no unplugged device back.
"""

import contextlib
import os
import socket
import time
from collections.abc import Callable, Iterable, Mapping

INTERVAL = 0.25
"""Shortest time between two notifications [s]."""
WAITS = "waits: "
"""What the status of a process begins with that waits for others."""
NO_ROUTER = "the router does not answer"
"""What a process says that waits for its router: no start of it anew would bring that back, and
what it has to say to others would be lost."""
NO_SAMPLES = "nothing comes from the device"
"""What processes say that wait for a device whose line is open: it is switched off, or silent."""
DEVICE_SILENT = frozenset(("starting", "stale", "garbage"))
"""States of data acquisition in which that is so."""
WAITS_AFTER = 5.0
"""Time without samples after which a process says that it waits [s]."""


def waits_for_samples(*, connected: bool) -> str:
    """What a process waits for that gets no samples over the bus."""
    return "no samples arrive" if connected else NO_ROUTER


def waits_of(rigs: Iterable[str]) -> str:
    """What a process waits for whose rigs wait for these; empty if one of them does not wait."""
    found = list(rigs)
    if not all(found):
        return ""
    return NO_ROUTER if NO_ROUTER in found else "no rig has samples to come"


class Heartbeat:
    """The notifications of one process to its supervisor.

    Args:
        name: the process, such as "daq".
        environment: holds `NOTIFY_SOCKET`.
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
        self._said_count = self._count = 0
        self._grown_at = clock()
        self._waits = ""
        if self._address:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)

    def ready(self, status: str = "running") -> None:
        """Report that the process has started: its device, bus or file is open."""
        self._say(f"READY=1\nSTATUS={status}\nX_RIGWATCH_COUNT={self._said_count}")

    def advance(self, count: int, waits: str = "") -> None:
        """Report a turn of the loop; `count` samples have passed since the start.

        Call it at every turn, even if `count` has not increased. It costs a clock reading. `waits`
        says what it waits for, if that is no fault of this process; it counts after some seconds.
        """
        now = self._clock()
        if self._socket is None or now - self._said_at < INTERVAL:
            return
        if count > self._count:
            self._count, self._grown_at = count, now
        waits = waits if now - self._grown_at >= WAITS_AFTER else ""
        words = ["WATCHDOG=1"] if count > self._said_count or waits else []
        if waits != self._waits:
            words.append(f"STATUS={WAITS + waits if waits else 'running'}")
        self._said_at = now
        if self._say("\n".join([*words, f"X_RIGWATCH_COUNT={count}"])):
            self._said_count, self._waits = count, waits  # else it is said again

    def status(self, text: str) -> None:
        """Report one line for people, such as "reconnecting to the device"."""
        self._say(f"STATUS={text}")

    def stopping(self) -> None:
        """Report that the process is stopping."""
        self._say("STOPPING=1")

    def still_stopping(self, within: float) -> None:
        """Report that it is still stopping, and ends or reports again within so many seconds."""
        self._say(f"STOPPING=1\nEXTEND_TIMEOUT_USEC={within * 1e6:.0f}")

    def _say(self, text: str) -> bool:
        """Whether the supervisor has it: a lost or slow one never stops what it monitors."""
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(text.encode(), self._address)
                return True
        return False


def _address(path: str) -> str:
    """The socket's address; a leading @ means the abstract namespace."""
    return "\0" + path[1:] if path.startswith("@") else path
