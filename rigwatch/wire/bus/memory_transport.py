"""The bus within one process: the same bytes, queues and refusals as over Zenoh.

All transports of one `MemoryNetwork` are connected. Payloads are delivered in the sender's thread.
"""

import fnmatch
import itertools
import threading
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import TypeVar

from rigwatch.wire.access import CommandSigner
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.transport import (
    LEASE,
    MAX_PAYLOAD,
    Answer,
    Close,
    Joining,
    Receive,
    Waiting,
    answered,
)
from rigwatch.wire.messages import bus_key

T = TypeVar("T")
_IDENTITIES = (f"process-{number}" for number in itertools.count(1))
MATCHES_KEPT = 4096
"""Keys and patterns whose match is remembered: each message meets the same ones again."""


class MemoryNetwork:
    """Counterpart of Zenoh's router: delivers everything put by one transport to all."""

    def __init__(self, lease: float = LEASE) -> None:
        self.lease = lease
        self.lock = threading.RLock()
        self.listeners: dict[str, list[Receive]] = {}
        self.servers: dict[str, list[Answer]] = {}
        self.tokens: list[str] = []
        self.watchers: list[tuple[str, Callable[[str, bool], None]]] = []
        self.up = True

    def bus(self, rig: str, process: str, signer: CommandSigner | None = None) -> Bus:
        """A process's bus on this network."""
        return Bus(MemoryTransport(self), rig, process, signer, lease=self.lease)

    def deliver(self, key: str, payload: bytes, sender: str, mark: bytes) -> None:
        """Deliver a payload to all subscribers, unless it is too large or the network is down."""
        with self.lock:
            receivers = [one for at in _with(self.listeners, key) for one in self.listeners[at]]
        if self.up and len(payload) <= MAX_PAYLOAD:
            for receive in receivers:
                receive(payload, sender, mark)

    def tell(self, key: str, alive: bool) -> None:
        """Notify the watchers of a token that it appeared or vanished."""
        for pattern, changed in tuple(self.watchers):
            if matches(key, pattern):
                changed(key, alive)


class MemoryTransport:
    """One process's link to a `MemoryNetwork`."""

    def __init__(self, network: MemoryNetwork) -> None:
        self._network = network
        self.identity = next(_IDENTITIES)
        self._closers: list[Close] = []

    def put(self, key: str, payload: bytes, mark: bytes = b"") -> None:
        """Send to all subscribers."""
        self._network.deliver(key, payload, self.identity, mark)

    def listen_from(self, key: str, receive: Receive) -> Close:
        """Call `receive` with each payload put to `key`, its sender's identity and its mark."""
        return self._register(self._network.listeners.setdefault(key, []), receive)

    def listen_waiting(self, key: str, receive: Receive) -> tuple[Waiting | None, Close]:
        """The same: nothing waits here."""
        return None, self.listen_from(key, receive)

    def put_among(self, rig: str, key: str, payload: bytes, mark: bytes = b"") -> None:
        """Send on its own: nothing is gained here by sending it among others."""
        self.put(bus_key(rig, key), payload, mark)

    def among(self, rig: str, key: str) -> Joining | None:  # noqa: ARG002
        """Nothing is joined here."""
        return None

    def listen_among(self, rig: str, key: str, receive: Receive) -> tuple[Waiting | None, Close]:
        """As `listen_waiting`."""
        return self.listen_waiting(bus_key(rig, key), receive)

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer queries to `key`."""
        return self._register(self._network.servers.setdefault(key, []), answer)

    def ask(self, key: str, question: bytes, timeout: float) -> list[bytes]:  # noqa: ARG002
        """The replies of all that serve `key`; a failing one does not reply."""
        with self._network.lock:
            table = self._network.servers
            servers = [one for at in tuple(table) if matches(at, key) for one in table[at]]
        replies: list[bytes] = []
        for answer in servers if self._network.up else ():
            replies += answered(answer, question)
        return replies

    def declare_token(self, key: str) -> Close:
        """Declare a token until closed."""
        with self._network.lock:
            self._network.tokens.append(key)
        self._network.tell(key, True)
        return self._closing(lambda: self._withdraw(key))

    def _withdraw(self, key: str) -> None:
        with self._network.lock:
            self._network.tokens.remove(key)
        self._network.tell(key, False)

    def tokens(self, pattern: str, timeout: float) -> list[str]:  # noqa: ARG002
        """Keys of the current tokens."""
        with self._network.lock:
            return [key for key in self._network.tokens if matches(key, pattern)]

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], None]) -> Close:
        """Call `changed(key, alive)` for matching tokens, first for existing ones."""
        close = self._register(self._network.watchers, (pattern, changed))
        for key in self.tokens(pattern, 0.0):
            changed(key, True)
        return close

    def connected(self) -> bool:
        """Whether the network is up."""
        return self._network.up

    def close(self) -> None:
        """Remove everything registered through this link."""
        for close in reversed(tuple(self._closers)):
            close()

    def _register(self, place: list[T], thing: T) -> Close:
        with self._network.lock:
            place.append(thing)
        return self._closing(lambda: place.remove(thing))

    def _closing(self, undo: Close) -> Close:
        """A function that runs `undo` once, at the latest in `close`."""

        def close() -> None:
            if close in self._closers:
                self._closers.remove(close)
                undo()

        self._closers.append(close)
        return close


def _with(patterns: Iterable[str], key: str) -> list[str]:
    """The patterns that a key matches."""
    return [one for one in tuple(patterns) if one == key or ("*" in one and matches(key, one))]


@lru_cache(maxsize=MATCHES_KEPT)
def matches(key: str, pattern: str) -> bool:
    """Whether a key matches a pattern, in which `*` stands for one part of the key."""
    parts, wanted = key.split("/"), pattern.split("/")
    return len(parts) == len(wanted) and all(map(fnmatch.fnmatchcase, parts, wanted))
