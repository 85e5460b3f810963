"""Connections that one thread makes and another can end, whichever library makes them.

Time limits of sockets are for each part of an answer: a server that sends a byte every few seconds,
in the handshake of TLS, the headers or a redirection, would hold a thread for ever. Python reports
each connection to audit hooks (PEP 578) before it is made; those of a watched thread are kept.
"""

import functools
import os
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_of_thread = threading.local()


class Connections:
    """The connections that one thread makes inside `watched`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sockets: list[socket.socket] = []
        self._is_cut = False

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Keep the connections that this thread makes meanwhile."""
        _listen()
        _of_thread.connections = self
        try:
            yield
        finally:
            _of_thread.connections = None
            with self._lock:
                for kept in self._sockets:
                    kept.close()
                self._sockets.clear()

    def cut(self) -> None:
        """End them, from any thread; those made later fail."""
        with self._lock:
            self._is_cut = True
            for kept in self._sockets:
                with suppress(OSError):  # it has ended already
                    kept.shutdown(socket.SHUT_RDWR)

    def _keep(self, descriptor: int) -> None:
        with self._lock:
            if self._is_cut:
                raise ConnectionAbortedError("the time for it is over")
            # A second descriptor: TLS takes the first one over, and responses close it.
            self._sockets.append(socket.socket(fileno=os.dup(descriptor)))


@functools.cache
def _listen() -> None:
    """Once: a hook cannot be removed."""
    sys.addaudithook(_hear)


def _hear(event: str, arguments: tuple[object, ...]) -> None:
    if event != "socket.connect":
        return
    connections: Connections | None = getattr(_of_thread, "connections", None)
    connecting = arguments[0]
    if connections is not None and hasattr(connecting, "fileno"):
        connections._keep(connecting.fileno())
