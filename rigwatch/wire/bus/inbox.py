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

from rigwatch.wire.bus.transport import Close, Receive, Take, Transport

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
        self._collect: Take | None = None

    def follow(self, transport: Transport, key: str, receive: Receive) -> Close:
        """Pass each message put to `key` to `receive`, which accepts what it is to keep."""
        self._collect, close = transport.listen_waiting(key, receive)
        return close

    def accept(self, message: T) -> bool:
        """Keep a message, if there is room."""
        if self._items.qsize() >= self._capacity:
            return False
        self._items.put(message)
        return True

    def put(self, item: T) -> None:
        """Add anything else, behind the messages that came before it."""
        if self._collect is not None:
            self._collect()
        self._items.put(item)

    def __len__(self) -> int:
        if self._collect is not None:
            self._collect()
        return self._items.qsize()

    def take(self, timeout: float) -> list[T]:
        """All that waits, after up to `timeout` [s] for the first."""
        until = time.monotonic() + timeout
        found: list[T] = []
        while not found and not len(self) and (left := until - time.monotonic()) > 0.0:
            # A channel does not wake its reader.
            wait = left if self._collect is None else min(left, LOOK_EVERY)
            with suppress(Empty):
                found.append(self._items.get(timeout=wait))
        return found + [self._items.get_nowait() for _ in range(self._items.qsize())]
