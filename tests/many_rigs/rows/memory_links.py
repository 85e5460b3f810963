"""Rigs of one process on a bus in memory, with their messages joined as over Zenoh."""

from collections import deque
from contextlib import AbstractContextManager
from functools import partial

from rigwatch.wire.bus import Bus
from rigwatch.wire.bus.memory_transport import MemoryNetwork, MemoryTransport
from rigwatch.wire.bus.several import (
    WAITING,
    Among,
    Following,
    JointLink,
    Received,
    Share,
    alone_key,
)
from rigwatch.wire.bus.transport import Close, Receive
from rigwatch.wire.messages import bus_key


class Line:
    """A key at which is sent."""

    def __init__(self, network: MemoryNetwork, key: str, sender: str) -> None:
        self._network, self._key, self._sender = network, key, sender

    def put(self, payload: bytes, mark: bytes) -> None:
        self._network.deliver(self._key, payload, self._sender, mark)

    @property
    def is_heard(self) -> bool:
        return bool(self._network.listeners.get(self._key))


class MemoryLinks:
    """The link that the rigs of one process share."""

    def __init__(self, network: MemoryNetwork) -> None:
        self.network = network
        self.own = MemoryTransport(network)
        self.common = JointLink(self._line, self._channel)

    def bus(self, rig: str, process: str) -> Bus:
        return Bus(JoinedTransport(self), rig, process, lease=self.network.lease)

    def together(self) -> AbstractContextManager[None]:
        return self.common.burst.held()

    def collect(self) -> None:
        self.common.collect()

    def _line(self, key: str) -> Line:
        return Line(self.network, key, self.own.identity)

    def _channel(self, key: str) -> Following:
        return self.following(key, 1024)[0]

    def following(self, key: str, capacity: int) -> tuple[Following, Close]:
        """What has come at a key, and what ends that."""
        waiting: deque[Received] = deque(maxlen=capacity)
        close = self.own.listen_from(key, lambda *one: waiting.append(one))
        return partial(_next, waiting), close


class JoinedTransport(MemoryTransport):
    """One rig's part of it."""

    def __init__(self, links: MemoryLinks) -> None:
        super().__init__(links.network)
        self.identity = links.own.identity
        self._links = links
        self._outlets: dict[tuple[str, str], Among] = {}

    def put(self, key: str, payload: bytes, mark: bytes = b"") -> None:
        burst = self._links.common.burst
        burst.add(lambda: super(JoinedTransport, self).put(key, payload, mark))

    def put_among(self, rig: str, key: str, payload: bytes, mark: bytes = b"") -> None:
        self.among(rig, key).put(payload, mark)

    def among(self, rig: str, key: str) -> Among:
        if (rig, key) not in self._outlets:
            line, common = self._links._line, self._links.common
            own = bus_key(rig, key)
            self._outlets[rig, key] = Among(
                rig, line(own), line(alone_key(own)), common.sender(key), common.burst
            )
        return self._outlets[rig, key]

    def listen_among(self, rig: str, key: str, receive: Receive) -> tuple[Share, Close]:
        alone, end = self._links.following(alone_key(bus_key(rig, key)), WAITING)
        share = self._links.common.receiver(key).add(rig, receive, alone)

        def close() -> None:
            share.undeclare()
            end()

        return share, self._closing(close)


def _next(waiting: deque[Received]) -> Received | None:
    return waiting.popleft() if waiting else None
