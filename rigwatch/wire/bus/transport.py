"""Interface of a transport, which carries bytes between processes: Zenoh, or memory in tests."""

from collections.abc import Callable
from typing import Protocol

from rigwatch.wire.messages import Topic, bus_key

MAX_PAYLOAD = 1 << 18
"""Largest payload of a message or reply [bytes]; larger ones are refused."""
LEASE = 10.0
"""Silence after which a link counts as broken, unless configured [s]."""

REFUSED_MARK, DENIED_MARK = b"zenoh_link_tls::unicast", b"Msg intercepted!"
"""In each line of Zenoh's log about a refused connection, and about a denied message."""
SILENT_MARK = b"Failed to accept link before deadline"
"""In its line about a connection that was closed since it did not say who it is."""
LINK_MARK = b"zenoh_transport::unicast::manager"
"""In that and all other lines of the same part of Zenoh, which are about links in order."""

Close = Callable[[], None]
Receive = Callable[[bytes, str, bytes], None]
"""Called with a payload, the identity of its sender and its mark."""
Answer = Callable[[bytes], list[bytes]]
"""Returns a query's replies as bytes, each at most `MAX_PAYLOAD` long."""


class Waiting(Protocol):
    """Messages that wait for a reader in its transport."""

    def take(self) -> None:
        """Pass them on, in order; may be called in any thread."""

    def may_hold(self) -> bool:
        """Whether there may be some; where rigs share messages, since the last `collect`."""

    def keep_order(self) -> None:
        """Something else waits for the reader: no message that comes from now on overtakes it."""


class Joining(Protocol):
    """Sends a topic of a rig among the messages of other rigs, or what has been joined already."""

    @property
    def is_followed(self) -> bool:
        """Whether anybody listens at the rig's own key."""

    @property
    def is_heard(self) -> bool:
        """Whether a process of several rigs listens."""

    @property
    def together_with(self) -> object:
        """Messages of those for which it is the same may be joined."""

    def put_own(self, payload: bytes, mark: bytes) -> None:
        """Send at the rig's own key alone."""

    def add_joined(self, message: bytes) -> None:
        """Send a joined message."""


class Transport(Protocol):
    """Carries bytes between processes. Keys are complete, such as "rig/bench1/daq/samples"."""

    @property
    def identity(self) -> str:
        """Identity of this process, unique on the bus."""

    def put(self, key: str, payload: bytes, mark: bytes = b"") -> None:
        """Send with a `mark`, without waiting; dropped if the link is full or down."""

    def listen_from(self, key: str, receive: Receive) -> Close:
        """Call `receive` with each payload put to `key`, in the transport's own thread.

        With it come the sender's `identity`, "" if unknown, and the mark.
        """

    def listen_waiting(self, key: str, receive: Receive) -> tuple[Waiting | None, Close]:
        """The same, where messages may wait until they are taken, in that thread; None: they don't.

        Of too many the oldest are dropped.
        """

    def put_among(self, rig: str, key: str, payload: bytes, mark: bytes = b"") -> None:
        """Send at a rig's `key`, among the messages of other rigs if rigs share the link.

        Who listens at the whole key gets it as with `put`.
        """

    def among(self, rig: str, key: str) -> Joining | None:
        """What `put_among` sends with, if it joins messages of rigs that share the link."""

    def listen_among(self, rig: str, key: str, receive: Receive) -> tuple[Waiting | None, Close]:
        """As `listen_waiting` at a rig's `key`, for what is sent with `put_among`."""

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer queries to `key`, in a thread of the transport."""

    def ask(self, key: str, question: bytes, timeout: float) -> list[bytes]:
        """The replies of all that serve `key` received within `timeout` [s]."""

    def declare_token(self, key: str) -> Close:
        """Declare a token at `key`, which vanishes when closed or when this process ends."""

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        """Keys of the current tokens that match `pattern` (`*`: one part of a key)."""

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], None]) -> Close:
        """Call `changed(key, alive)` for matching tokens, first for existing ones."""

    def connected(self) -> bool:
        """Whether there is currently a link to the router."""

    def close(self) -> None:
        """Close everything opened through this transport."""


def send(
    transport: Transport, rig: str, topic: Topic, process: str, payload: bytes, *, mark: bytes = b""
) -> None:
    """Send a message of a topic as `process` of a rig."""
    key = topic.key_of(process)
    if topic.joined:
        transport.put_among(rig, key, payload, mark)
    else:
        transport.put(bus_key(rig, key), payload, mark)


def answered(answer: Answer, question: bytes) -> list[bytes]:
    """The replies to a query; none if the server fails or a reply is too large."""
    try:
        return [reply for reply in answer(question) if len(reply) <= MAX_PAYLOAD]
    except Exception:
        # A query comes from outside: it must not end the serving thread.
        return []
