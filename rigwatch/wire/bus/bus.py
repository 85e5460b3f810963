"""The bus between the processes of a rig: messages, questions, and who is alive.

    Bus             what processes use: messages in and out, encoded and checked here
     └ Transport    what carries the bytes: Zenoh, or memory (`zenoh_transport`, `memory_transport`)

Publishing never waits for a reader: where a reader or the link is too slow, messages are dropped,
and readers that cannot afford that ask a ring (`ring.py`) for what they miss. A receiving callback
only puts bytes into a bounded queue; they are decoded in the thread that takes them out, so that a
bad message is counted there and hurts nobody.
"""

import os
import threading
from collections.abc import Callable, Mapping

from rigwatch.wire.bus.complete_subscription import CompleteSubscription, Place
from rigwatch.wire.bus.message_ring import LARGEST_NUMBERED, Outlet
from rigwatch.wire.bus.subscription import QUEUE_CAPACITY, Subscription
from rigwatch.wire.bus.transport import MAX_PAYLOAD, Answer, Close, Transport
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import ALIVE_KEY, Message, Topic, bus_key, encode


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
        self._outlet: Outlet | None = None
        self._lock = threading.Lock()
        self._at_close: list[Close] = []
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
        largest = LARGEST_NUMBERED if topic.numbered else MAX_PAYLOAD
        if len(payload) > largest:
            size = f"found a message of {len(payload)} bytes, expected at most {largest}"
            raise BusError(f"{topic.name}: {size}")
        if topic.numbered:
            self._numbered().put(topic, payload)
        else:
            self.transport.put(self.key(topic.key), payload)

    def _numbered(self) -> Outlet:
        with self._lock:
            if self._outlet is None:
                self._outlet = Outlet(self.transport, self.rig, self.process)
            return self._outlet

    def subscribe(self, topic: Topic, capacity: int = QUEUE_CAPACITY) -> Subscription:
        """The topic's messages from now on; of a numbered topic every one, once and in order."""
        if topic.numbered:
            return self.listen(topic, capacity=capacity)
        return self.overhear(topic, capacity)

    def listen(
        self,
        topic: Topic,
        resume_after: Mapping[str, Place] | None = None,
        capacity: int = QUEUE_CAPACITY,
    ) -> CompleteSubscription:
        """The messages of a numbered topic, from those on that an earlier run has dealt with."""
        return CompleteSubscription(self, topic, capacity, resume_after)

    def overhear(self, topic: Topic, capacity: int = QUEUE_CAPACITY) -> Subscription:
        """The topic's messages as they come: for who may miss some, such as a screen."""
        subscription = Subscription(topic, capacity)
        subscription._close = self.transport.listen(self.key(topic.key), subscription.receive)
        return subscription

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer questions to `key` of this rig, in another thread; an error there is no reply."""
        return self.transport.serve(self.key(key), answer)

    def query(self, key: str, question: bytes = b"", timeout: float = 1.0) -> list[bytes]:
        """Replies of all processes that serve `key` of this rig, none where there is no such."""
        return self.transport.ask(self.key(key), question, timeout)

    @property
    def identity(self) -> str:
        """Who this process is to those that hear it."""
        return self.transport.identity

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

    def at_close(self, end: Close) -> None:
        """Have `close` call `end`, which returns once a thread no longer uses the bus."""
        self._at_close.append(end)

    def close(self) -> None:
        """Leave the bus; the process's tokens vanish, and no thread waits for a reply any more."""
        self.transport.close()
        for end in self._at_close:
            end()


def unique_process(name: str) -> str:
    """A process name that no other process has, for tools that may run twice at a time."""
    return f"{name}-{os.getpid()}"
