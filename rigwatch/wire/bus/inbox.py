"""What waits for one reader, in the order in which it came.

    transport ──messages──▶ (its own channel) ──▶ accept ──▶ inbox ──▶ reader
    tokens, replies of rings ──────────────────────────────▶

Where rigs share a link their messages wait in the transport's channel, which takes them without the
interpreter, until the reader looks or something else comes that must not overtake them.
"""

import time
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Generic, TypeVar

from rigwatch.wire.bus.member import Member
from rigwatch.wire.bus.transport import Close, Receive, Waiting
from rigwatch.wire.messages import Topic

T = TypeVar("T")
LOOK_EVERY = 0.005
"""Time between looks into a channel by a reader that waits [s]."""


class Inbox(Generic[T]):
    """One reader's inbox; only the reader takes from it.

    Args:
        capacity: messages queued before further ones are refused.
    """

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._items: SimpleQueue[T] = SimpleQueue()
        self._outside: Waiting | None = None

    def follow(self, bus: Member, topic: Topic, receive: Receive) -> Close:
        """Pass each message of a topic to `receive`, which accepts what it is to keep."""
        self._outside, close = bus.hear(topic, receive)
        return close

    def accept(self, message: T) -> bool:
        """Keep a message, if there is room."""
        if self._items.qsize() >= self._capacity:
            return False
        self._items.put(message)
        return True

    def put(self, item: T) -> None:
        """Add anything else, behind the messages that came before it."""
        if self._outside is not None:
            self._outside.take()
        self._items.put(item)
        self.keep_order()

    def keep_order(self) -> None:
        """Nothing outside may overtake what waits, or is to be read, here."""
        if self._outside is not None:
            self._outside.keep_order()

    @property
    def outside(self) -> Waiting | None:
        """Where messages wait before they are accepted; None if they do not."""
        return self._outside

    def is_read(self) -> bool:
        """Whether nothing waits here, whatever waits outside."""
        return self._items.empty()

    def may_hold(self) -> bool:
        """Whether something may wait: a look that costs less than the number."""
        outside = self._outside
        return self._items.qsize() > 0 or (outside is not None and outside.may_hold())

    def __len__(self) -> int:
        if self._outside is not None:
            self._outside.take()
        return self._items.qsize()

    def take(self, timeout: float) -> list[T]:
        """All that waits, after up to `timeout` [s] for the first."""
        until = time.monotonic() + timeout
        found: list[T] = []
        while not found and not len(self) and (left := until - time.monotonic()) > 0.0:
            # A channel does not wake its reader.
            wait = left if self._outside is None else min(left, LOOK_EVERY)
            with suppress(Empty):
                found.append(self._items.get(timeout=wait))
        return found + [self._items.get_nowait() for _ in range(self._items.qsize())]
