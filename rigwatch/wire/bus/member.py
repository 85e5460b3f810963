"""A process on the bus of a rig: what it says, serves and asks, and who else is there."""

import os
import threading
from collections.abc import Callable

from rigwatch.wire.access import CommandSigner
from rigwatch.wire.bus.kept_messages import KeptMessages
from rigwatch.wire.bus.message_ring import LARGEST_NUMBERED, RING_BYTES, MessageRing, Outlet
from rigwatch.wire.bus.tokens import Changed, NamedToken, NamedTokens
from rigwatch.wire.bus.transport import (
    LEASE,
    MAX_PAYLOAD,
    Answer,
    Close,
    Joining,
    Receive,
    Transport,
    Waiting,
    send,
)
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import ALIVE_KEY, Message, Topic, bus_key, encode


class Member:
    """One process on the bus of one rig, without what it hears: see `Bus`.

    Args:
        transport: carries the bytes.
        rig: the rig's id, first part of every key.
        process: name of the process, such as "daq"; a liveliness token exists while it lives.
        signer: signs the commands of this machine's operator; None for a process that sends none.
        ring_bytes: memory of the ring of each numbered topic [bytes].
        lease: silence after which a link counts as broken: the tokens of a process may outlive it
            by as much [s].

    Attributes:
        questions_refused: queries without an answer, as they were none that is asked here.
    """

    def __init__(
        self,
        transport: Transport,
        rig: str,
        process: str,
        signer: CommandSigner | None = None,
        ring_bytes: int = RING_BYTES,
        *,
        lease: float = LEASE,
    ) -> None:
        self.transport = transport
        self.signer = signer
        self.rig = rig
        self.process = process
        self.lease = lease
        self.questions_refused = 0
        self._ring_bytes = ring_bytes
        self._outlet: Outlet | None = None
        self._lock = threading.Lock()
        self._names = NamedTokens(transport)
        self._at_close: list[Close] = [self._names.close]
        transport.declare_token(self.key(f"{ALIVE_KEY}/{_token_name(process)}"))

    def key(self, key: str) -> str:
        """The full bus key of `key` within the rig."""
        return bus_key(self.rig, key)

    def publish(self, topic: Topic, message: Message) -> None:
        """Send a message to all subscribers without waiting for any of them.

        Raises:
            BusError: the message is larger than the bus carries.
        """
        self.publish_encoded(topic, encode(message))

    def publish_encoded(self, topic: Topic, payload: bytes) -> None:
        """The same with the bytes of a message.

        Raises:
            BusError: they are more than the bus carries.
        """
        largest = LARGEST_NUMBERED if topic.numbered else MAX_PAYLOAD
        if len(payload) > largest:
            size = f"found a message of {len(payload)} bytes, expected at most {largest}"
            raise BusError(f"{topic.name}: {size}")
        if topic.numbered:
            self._numbered().put(topic, payload)
        else:
            send(self.transport, self.rig, topic, self.process, payload)

    def hear(self, topic: Topic, receive: Receive) -> tuple[Waiting | None, Close]:
        """Call `receive` with the messages of a topic, see `Transport.listen_waiting`."""
        if topic.joined:
            return self.transport.listen_among(self.rig, topic.key, receive)
        return self.transport.listen_waiting(self.key(topic.key), receive)

    def joining(self, topic: Topic) -> tuple[Joining, MessageRing] | None:
        """How a numbered topic is sent among other rigs, for a sender that joins the messages.

        It keeps each in the ring first, which gives it its number. None if each rig sends its own.
        """
        found = self.transport.among(self.rig, topic.key) if topic.joined else None
        return None if found is None else (found, self._numbered().ring_of(topic))

    def announce(self, kept: KeptMessages | None = None) -> None:
        """Show subscribers who sends numbered messages here, before the first one.

        One that is killed before that, and what it said to nobody, is then reported as a gap.

        Args:
            kept: file of the alarms that are sent, for the next run of this process.
        """
        self._numbered(kept)

    def _numbered(self, kept: KeptMessages | None = None) -> Outlet:
        with self._lock:
            if self._outlet is None:
                self._outlet = Outlet(
                    self.transport, self.rig, self.process, self._ring_bytes, kept,
                    counted=self._counted,
                )  # fmt: skip
            return self._outlet

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer queries to `key` of this rig, in another thread; an error there gives no reply."""
        return self.transport.serve(self.key(key), self._counted(answer))

    def _counted(self, answer: Answer) -> Answer:
        """The same answers; questions that end in an error are counted."""

        def counting(question: bytes) -> list[bytes]:
            try:
                return answer(question)
            except Exception:
                self.questions_refused += 1
                raise

        return counting

    def query(self, key: str, question: bytes = b"", timeout: float = 1.0) -> list[bytes]:
        """Replies of all processes that serve `key` of this rig; none if there are none."""
        return self.transport.ask(self.key(key), question, timeout)

    @property
    def identity(self) -> str:
        """Identity of this process on the bus."""
        return self.transport.identity

    def declare_token(self, key: str) -> Close:
        """Declare a liveliness token at `key` of this rig until closed or the process ends."""
        return self.transport.declare_token(self.key(key))

    def tokens(self, pattern: str, timeout: float = 1.0) -> list[str]:
        """Keys of the current liveliness tokens within this rig, such as "alive/daq"."""
        head = len(self.key(""))
        return [key[head:] for key in self.transport.tokens(self.key(pattern), timeout)]

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], None]) -> Close:
        """Call `changed(key, alive)`, in another thread, for tokens that match."""
        head = len(self.key(""))
        return self.transport.watch_tokens(
            self.key(pattern), lambda key, alive: changed(key[head:], alive)
        )

    def named_token(self, place: str) -> NamedToken:
        """A token of this process at `place`, to be declared with a name."""
        return NamedToken(self.transport, self.key(place))

    def names(self, places: str, timeout: float = 1.0) -> list[tuple[str, str | None]]:
        """Place and name of each token with a name; None for one that is not known."""
        head = len(self.key(""))
        found = self._names.names(self.key(places), timeout)
        return [(place[head:], name) for place, name in found]

    def holders(self, place: str) -> set[str]:
        """The names of all that hold a token at `place`.

        Tokens of two processes at one key are one to those that watch them; each answers, though.
        """
        return self._names.holders(self.key(place))

    def watch_names(self, places: str, changed: Changed) -> Close:
        """Follow tokens with names, in another thread (`tokens/watching.py`)."""
        head = len(self.key(""))
        return self._names.watch(
            self.key(places), lambda place, *rest: changed(place[head:], *rest)
        )

    def connected(self) -> bool:
        """Whether the router is currently connected."""
        return self.transport.connected()

    def at_close(self, end: Close) -> Close:
        """Register `end` to be called by `close`; it returns when a thread has left the bus.

        Returns:
            Removes the registration.
        """
        self._at_close.append(end)
        return lambda: self._at_close.remove(end)

    def close(self) -> None:
        """Leave the bus: the process's tokens vanish, and waiting queries end."""
        self.transport.close()
        for end in tuple(self._at_close):
            end()


def unique_process(name: str) -> str:
    """A unique process name, for tools of which several may run at once."""
    return f"{name}{_own_number()}"


def _own_number() -> str:
    return f"-{os.getpid()}"


def _token_name(process: str) -> str:
    """Tools share a token: Zenoh never forgets the key of one (`tokens`)."""
    return process.removesuffix(_own_number())
