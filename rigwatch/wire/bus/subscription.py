"""Messages of one topic, queued for a reader that may be slower than the sender."""

import contextlib
import time
from collections.abc import Iterator
from queue import Empty, SimpleQueue
from typing import Any

from rigwatch.wire.bus.inbox import LOOK_EVERY
from rigwatch.wire.bus.transport import MAX_PAYLOAD, Close, Waiting
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import Topic, decode
from rigwatch.wire.ordering import SenderRates

MOST_COMMANDS = 8
"""Operators' commands executed per turn of a loop, so that a flood of them delays nothing else."""
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
        self._rates = SenderRates() if topic.is_rare else None
        self._waiting: SimpleQueue[tuple[bytes, str]] = SimpleQueue()
        self._outside: list[Waiting] = []
        self._ends: list[Close] = []

    def __len__(self) -> int:
        self._look_outside()
        return self._waiting.qsize()

    def may_hold(self) -> bool:
        """Whether something may wait: a look that costs less than the number, see `Waiting`."""
        return self._waiting.qsize() > 0 or any(one.may_hold() for one in self._outside)

    def follow(self, outside: Waiting | None, end: Close) -> None:
        """Read what waits there as well, None if it is received as it comes; `end` closes it."""
        self._ends.append(end)
        if outside is not None:
            self._outside.append(outside)

    def _look_outside(self) -> None:
        for one in self._outside:
            one.take()

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
        until = float("inf") if timeout is None else time.monotonic() + timeout
        self._look_outside()
        while (found := self._queued(until)) is None and time.monotonic() < until:
            self._look_outside()
        return found

    def _queued(self, until: float = 0.0) -> tuple[Any, str] | None:
        """The next valid one that has been received, by monotonic time `until` [s]."""
        while True:
            left = max(0.0, until - time.monotonic())
            # What waits outside does not wake its reader.
            wait = min(left, LOOK_EVERY) if self._outside else left
            try:
                payload, sender = self._waiting.get(
                    block=wait > 0.0, timeout=None if wait == float("inf") else wait
                )
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
        return [message for message, _ in self.drain_from(most)]

    def drain_from(self, most: int | None = None) -> list[tuple[Any, str]]:
        """The same, each with the identity of its sender."""
        waiting = len(self)
        count = waiting if most is None else min(most, waiting)
        found = [self._queued() for _ in range(count)]
        return [one for one in found if one is not None]

    def __iter__(self) -> Iterator[Any]:
        while True:
            yield self.get()

    def close(self) -> None:
        """Stop receiving."""
        for end in self._ends:
            end()
