"""Messages of one topic, queued for a reader that may be slower than the sender."""

import contextlib
import time
from collections.abc import Iterator
from queue import Empty, SimpleQueue
from typing import Any

from rigwatch.wire.bus.transport import MAX_PAYLOAD, Close
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import Topic, decode
from rigwatch.wire.ordering import SenderRates

MOST_COMMANDS = 8
"""Operators' commands executed per turn of a loop, so that a flood of them delays nothing else."""
MOST_LIMITED = 1.0
"""Rate in normal running up to which a topic's messages are few [Hz]."""
QUEUE_CAPACITY = 4096
"""Number of messages queued for a slow reader before the oldest are dropped."""


class Subscription:
    """Messages of one topic in a bounded queue; the oldest are dropped when it is full.

    Of a topic whose messages are few, each client may send no more than its share (`SenderRates`).

    Attributes:
        dropped: messages dropped because the reader was slow.
        rejected: payloads dropped because they were too large or invalid.
    """

    def __init__(self, topic: Topic, capacity: int = QUEUE_CAPACITY) -> None:
        self.topic = topic
        self.dropped = 0
        self.rejected = 0
        self._capacity = capacity
        self._rates = SenderRates() if topic.rate_hz <= MOST_LIMITED else None
        self._waiting: SimpleQueue[tuple[bytes, str]] = SimpleQueue()
        self._close: Close = lambda: None

    def __len__(self) -> int:
        return self._waiting.qsize()

    @property
    def refused(self) -> int:
        """Messages dropped because their client sent more than its share."""
        return self._rates.refused if self._rates else 0

    def receive(self, payload: bytes, sender: str = "", _mark: bytes = b"") -> None:
        """Accept one payload from the transport; never waits, never raises."""
        if len(payload) > MAX_PAYLOAD:
            self.rejected += 1
            return
        if self._rates and not self._rates.admits(sender, len(payload), time.monotonic()):
            return
        if self._waiting.qsize() >= self._capacity:
            with contextlib.suppress(Empty):
                self._waiting.get_nowait()
                self.dropped += 1
        self._waiting.put((payload, sender))

    def get(self, timeout: float | None = None) -> Any:
        """The next message of the topic's class, or None if none arrives within `timeout` [s].

        Args:
            timeout: 0 does not wait, None waits indefinitely.
        """
        found = self._next(timeout)
        return None if found is None else found[0]

    def _next(self, timeout: float | None) -> tuple[Any, str] | None:
        """The same with the identity of its sender."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            try:
                payload, sender = self._waiting.get(block=left != 0.0, timeout=left)
            except Empty:
                return None
            with contextlib.suppress(MessageError):
                return decode(self.topic.message, payload), sender
            self.rejected += 1

    def drain(self, most: int | None = None) -> list[Any]:
        """The waiting messages, oldest first.

        Args:
            most: number of messages taken from the queue; None for all.
        """
        waiting = self._waiting.qsize()
        count = waiting if most is None else min(most, waiting)
        found = [self.get(timeout=0) for _ in range(count)]
        return [message for message in found if message is not None]

    def drain_from(self) -> list[tuple[Any, str]]:
        """The waiting messages, oldest first, each with the identity of its sender."""
        found = [self._next(timeout=0) for _ in range(self._waiting.qsize())]
        return [one for one in found if one is not None]

    def __iter__(self) -> Iterator[Any]:
        while True:
            yield self.get()

    def close(self) -> None:
        """Stop receiving."""
        self._close()
