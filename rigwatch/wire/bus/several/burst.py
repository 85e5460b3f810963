"""Messages of the rigs of one process, sent together.

A message on its own wakes the threads of three processes and costs each of them some ten times what
it costs among others: 0.2 ms to send and 0.4 ms to receive, against 20 and 40 µs. So what is put
within a moment is sent in one go.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

GATHER = 0.003
"""Longest time from the first message of a burst to its sending [s]."""
Put = Callable[[], None]


class Burst:
    """Gathers what is to be sent, and sends it in order.

    What is added while `held` leaves at its end, or with a later message once it has waited for too
    long; anything else a moment later, from a thread that is started when it is first needed.
    """

    def __init__(self) -> None:
        self._waiting: list[Put] = []
        self._since = 0.0
        self._holders = 0
        self._lock = threading.Lock()
        self._sending = threading.Lock()
        self._some = threading.Event()
        self._closed = False
        self._thread: threading.Thread | None = None

    def add(self, put: Put) -> None:
        """Send with the next burst."""
        with self._lock:
            if not self._waiting:
                self._since = time.monotonic()
            self._waiting.append(put)
            held = self._holders > 0
            overdue = held and time.monotonic() - self._since > GATHER
        if overdue:
            self.send()
        elif not held:
            self._send_soon()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Gather what is added meanwhile."""
        with self._lock:
            self._holders += 1
        try:
            yield
        finally:
            with self._lock:
                self._holders -= 1
            self.send()

    def send(self) -> None:
        """Send what waits now."""
        with self._sending:
            with self._lock:
                waiting, self._waiting = self._waiting, []
            for put in waiting:
                put()

    def close(self) -> None:
        """Send the rest, and end the thread."""
        self._closed = True
        self._some.set()
        if self._thread is not None:
            self._thread.join()
        self.send()

    def _send_soon(self) -> None:
        with self._lock:
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._run, name="burst", daemon=True)
                self._thread.start()
        self._some.set()

    def _run(self) -> None:
        while not self._closed:
            self._some.wait()
            self._some.clear()
            if not self._closed:
                time.sleep(GATHER)
            self.send()
