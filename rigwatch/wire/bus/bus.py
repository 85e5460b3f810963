"""The bus between the processes of a rig: messages, questions, and who is alive.

    Bus             what processes use: messages in and out, encoded and checked here
     └ Transport    what carries the bytes: Zenoh (`bus_zenoh.py`) or memory (`bus_memory.py`)

Publishing never waits for a reader: where a reader or the link is too slow, messages are dropped,
and readers that cannot afford that ask a ring (`ring.py`) for what they miss. A receiving callback
only puts bytes into a bounded queue; they are decoded in the thread that takes them out, so that a
bad message is counted there and hurts nobody.
"""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import Any, Protocol

from rigwatch.wire.errors import BusError, MessageError
from rigwatch.wire.messages import ALIVE_KEY, Message, Topic, bus_key, decode, encode
from rigwatch.wire.rig_config import RigConfig

MAX_PAYLOAD = 1 << 18
"""Largest payload that any of our messages or replies has [bytes]; larger ones are refused."""
QUEUE_CAPACITY = 4096
"""Messages a subscription holds for a slow reader before the oldest are dropped."""

Close = Callable[[], None]
Answer = Callable[[bytes], list[bytes]]
"""Given a question's bytes, the replies' bytes, none of them above `MAX_PAYLOAD`."""


class Transport(Protocol):
    """What carries bytes between processes. Keys are whole, such as "rig/bench1/daq/samples"."""

    def put(self, key: str, payload: bytes) -> None:
        """Send without waiting; dropped where the link is full or down."""

    def listen(self, key: str, receive: Callable[[bytes], None]) -> Close:
        """Call `receive` with each payload put to `key`, in the transport's own thread."""

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer questions to `key`, in a thread of the transport."""

    def ask(self, key: str, question: bytes, timeout: float) -> list[bytes]:
        """The replies of all that serve `key`, as many as came within `timeout` [s]."""

    def declare_token(self, key: str) -> Close:
        """Show a token at `key` that vanishes when closed or when this process dies."""

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        """Keys of the tokens that are alive now and match `pattern` (`*`: one part of a key)."""

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], None]) -> Close:
        """Call `changed(key, alive)` for tokens that match, first for those there already."""

    def connected(self) -> bool:
        """Whether there is a link to the router now."""

    def close(self) -> None:
        """Close everything that was opened through this transport."""


class Subscription:
    """Messages of one topic, waiting in a bounded queue; the oldest are dropped when it is full.

    Attributes:
        dropped: messages dropped because the reader was slow.
        rejected: payloads dropped because they were too large or no such message.
    """

    def __init__(self, topic: Topic, capacity: int = QUEUE_CAPACITY) -> None:
        self.topic = topic
        self.dropped = 0
        self.rejected = 0
        self._capacity = capacity
        self._waiting: SimpleQueue[bytes] = SimpleQueue()
        self._close: Close = lambda: None

    def __len__(self) -> int:
        return self._waiting.qsize()

    def receive(self, payload: bytes) -> None:
        """Take one payload from the transport; never waits, never raises."""
        if len(payload) > MAX_PAYLOAD:
            self.rejected += 1
            return
        if self._waiting.qsize() >= self._capacity:
            with contextlib.suppress(Empty):
                self._waiting.get_nowait()
                self.dropped += 1
        self._waiting.put(payload)

    def get(self, timeout: float | None = None) -> Any:
        """The next message of the topic's class, or None when none came within `timeout` [s].

        Args:
            timeout: 0 does not wait, None waits for ever.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            try:
                payload = self._waiting.get(block=left != 0.0, timeout=left)
            except Empty:
                return None
            with contextlib.suppress(MessageError):
                return decode(self.topic.message, payload)
            self.rejected += 1

    def drain(self) -> list[Any]:
        """All messages that wait now, oldest first."""
        found = [self.get(timeout=0) for _ in range(self._waiting.qsize())]
        return [message for message in found if message is not None]

    def __iter__(self) -> Iterator[Any]:
        while True:
            yield self.get()

    def close(self) -> None:
        """Receive no more."""
        self._close()


class Bus:
    """One process's place on the bus of one rig.

    Args:
        transport: what carries the bytes.
        rig: the rig's id, first part of every key.
        process: who speaks, such as "daq"; shown by a liveliness token for as long as it lives.
    """

    def __init__(self, transport: Transport, rig: str, process: str) -> None:
        self.transport = transport
        self.rig = rig
        self.process = process
        transport.declare_token(self.key(f"{ALIVE_KEY}/{process}"))

    def key(self, key: str) -> str:
        """The whole key of a rig's `key`."""
        return bus_key(self.rig, key)

    def publish(self, topic: Topic, message: Message) -> None:
        """Send a message to all who listen; never waits for any of them.

        Raises:
            BusError: the message is larger than the bus carries.
        """
        payload = encode(message)
        if len(payload) > MAX_PAYLOAD:
            size = f"found a message of {len(payload)} bytes, expected at most {MAX_PAYLOAD}"
            raise BusError(f"{topic.name}: {size}")
        self.transport.put(self.key(topic.key), payload)

    def subscribe(self, topic: Topic, capacity: int = QUEUE_CAPACITY) -> Subscription:
        """The topic's messages from now on."""
        subscription = Subscription(topic, capacity)
        subscription._close = self.transport.listen(self.key(topic.key), subscription.receive)
        return subscription

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer questions to `key` of this rig, in another thread; an error there is no reply."""
        return self.transport.serve(self.key(key), answer)

    def query(self, key: str, question: bytes = b"", timeout: float = 1.0) -> list[bytes]:
        """Replies of all processes that serve `key` of this rig, none where there is no such."""
        return self.transport.ask(self.key(key), question, timeout)

    def declare_token(self, key: str) -> Close:
        """Show a liveliness token at `key` of this rig until closed or dead."""
        return self.transport.declare_token(self.key(key))

    def tokens(self, pattern: str, timeout: float = 1.0) -> list[str]:
        """Keys below this rig of the tokens alive now, such as "alive/daq"."""
        head = len(self.key(""))
        return [key[head:] for key in self.transport.tokens(self.key(pattern), timeout)]

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], None]) -> Close:
        """Call `changed(key, alive)`, in another thread, for tokens that match."""
        head = len(self.key(""))
        return self.transport.watch_tokens(
            self.key(pattern), lambda key, alive: changed(key[head:], alive)
        )

    def connected(self) -> bool:
        """Whether the router is reached now."""
        return self.transport.connected()

    def close(self) -> None:
        """Leave the bus; the process's tokens vanish."""
        self.transport.close()


def connect(config: RigConfig, process: str, timeout: float | None = None) -> Bus:
    """Join the bus of a rig as `process`.

    Args:
        config: the rig's configuration.
        process: name of the process, such as "daq".
        timeout: how long the router may take to be reached [s]; None waits for ever, so that
            processes can be started in any order. Once reached, a lost router is found again
            in the background.

    Raises:
        BusError: the router was not reached within `timeout`, or its endpoint is wrong.
    """
    from rigwatch.wire.bus.zenoh_transport import (
        ZenohTransport,  # slow to import, not needed in memory
    )

    transport = ZenohTransport.client(config.bus.router, timeout, config.bus.lease)
    return Bus(transport, config.rig.id, process)


def answered(answer: Answer, question: bytes) -> list[bytes]:
    """The replies to a question; none where the one who answers fails or says too much."""
    try:
        return [reply for reply in answer(question) if len(reply) <= MAX_PAYLOAD]
    except Exception:
        # A question comes from outside: it must not end the thread that serves.
        return []


def wait_until(holds: Callable[[], bool], timeout: float, pause: float = 0.02) -> bool:
    """Poll until `holds()` or until `timeout` [s] has passed; returns what it said last."""
    deadline = time.monotonic() + timeout
    while not (done := holds()) and time.monotonic() < deadline:
        time.sleep(pause)
    return done


def unique_process(name: str) -> str:
    """A process name that no other process has, for tools that may run twice at a time."""
    return f"{name}-{os.getpid()}"
