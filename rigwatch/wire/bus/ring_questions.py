"""Queries rings for missing messages in a separate thread, so that reading never waits."""

import contextlib
import threading
import time
from collections.abc import Callable
from queue import SimpleQueue

from rigwatch.wire.bus.member import Member
from rigwatch.wire.errors import BusError
from rigwatch.wire.ordering import Ask

REPLY_TIMEOUT = 1.0
"""Longest wait for the first reply [s]."""
MOST_PATIENT = 3
"""Largest power of two by which the wait grows while a query is repeated, after every second one:
an answer that is too late is work for a ring that has too much of it.
"""
END_TIMEOUT = 2.0
"""Longest wait of the closing bus for the query thread [s]."""
PAUSES = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Delays before an unanswered query is repeated [s]."""


class RingQuestions:
    """One reader's queries.

    Args:
        bus: on which the rings reply.
        answered: called in the query thread with each query's key, the query and its replies,
            empty if there are none.
    """

    def __init__(self, bus: Member, answered: Callable[[str, Ask, list[bytes]], None]) -> None:
        self._bus, self._answered = bus, answered
        self._questions: SimpleQueue[tuple[str, Ask] | None] = SimpleQueue()
        self._closed = False
        self._thread = threading.Thread(target=self._ask_on, name="ring-questions", daemon=True)
        self._left = bus.at_close(self._end)
        self._thread.start()

    def ask(self, key: str, ask: Ask) -> None:
        """Send a query to the rings at `key`."""
        self._questions.put((key, ask))

    def close(self) -> None:
        """Stop querying."""
        self._closed = True
        self._questions.put(None)

    def _end(self) -> None:
        # If the interpreter ends while a thread waits in Zenoh, the process aborts (CPython 87135).
        self.close()
        self._thread.join(END_TIMEOUT)

    def _ask_on(self) -> None:
        repeats: dict[str, tuple[Ask, int]] = {}
        while (question := self._questions.get()) is not None:
            key, ask = question
            before, count = repeats.get(key, (None, 0))
            count = count + 1 if ask == before else 0
            repeats[key] = ask, count
            if count:
                time.sleep(PAUSES[min(count, len(PAUSES)) - 1])
            timeout = REPLY_TIMEOUT * 2 ** min(count // 2, MOST_PATIENT)
            self._answered(key, ask, self._replies(key, ask, timeout))
        self._left()

    def _replies(self, key: str, ask: Ask, timeout: float) -> list[bytes]:
        while not (self._bus.connected() or self._closed):
            time.sleep(0.05)
        with contextlib.suppress(BusError):
            return self._bus.query(key, ask.to_bytes(), timeout)
        return []
