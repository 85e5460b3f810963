"""The bus over Zenoh: every process is a client of one router, which is also a Python session.

Reasons for the settings:

* clients with an endpoint and no scouting: two peers behind one router silently exchange nothing;
* endless retries after 100 to 200 ms: a restarted router is found again within that time;
* congestion control DROP: with BLOCK one frozen reader stops the publisher for seconds;
* queries and replies, which fetch what was dropped, have a queue of their own (`DATA_HIGH`);
* `express` is off: with it, Zenoh lost a quarter of the messages at high rates;
* a limit on payload size in the router: payloads larger than any valid message are not forwarded;
* no shared memory: it would hold 16 MB for each process, left behind by a kill, and 2 to 8 MB more
  in each other process that it speaks to, for messages of which few are longer than 3 kB;
* a connection that sends nothing is closed after a second, so that a flood of them causes little
  delay.
"""

import contextlib
import json
import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any, TypeVar

import zenoh
from zenoh.handlers import Callback, RingChannel

from rigwatch.wire.bus.several import (
    WAITING,
    Alone,
    Among,
    Following,
    JointLink,
    Received,
    alone_key,
)
from rigwatch.wire.bus.transport import (
    LEASE,
    MAX_PAYLOAD,
    Answer,
    Close,
    Receive,
    Waiting,
    answered,
)
from rigwatch.wire.errors import BusError, NoRouterError
from rigwatch.wire.messages import bus_key

RETRY_MS = (100, 200)
BATCHES = 16
"""Batches of 64 kB that wait for a slow link before messages are dropped: rigs share a link, and
with two, Zenoh's own number, a reader that pauses for 80 ms loses messages of twenty-four.
"""
MOST_ASKED = 4
"""Queries at a time over a link that rigs share: after a stall all ask at once, and answers that
come too late would be asked for again, without end.
"""
JOINTS_WAITING = 1024
"""Joined messages that wait, of which many rigs send up to seven in a turn: five seconds."""
UNSURE = 1.0
"""Time after which a router has told whether anybody listens at a key [s]."""
ACCEPT_MS, MOST_PENDING = 1000, 1000
"""Router's time limit for a connection to identify itself [ms], and number of pending ones."""
ATTEMPT_MS = 300
"""Time of one connection attempt [ms]; short, since signals are handled only between attempts."""
_INTERCEPTORS = "zenoh::net::routing::interceptor"
_LOGGED = (
    "zenoh=error,zenoh_link_tls=warn,zenoh_transport::unicast::manager=debug,"
    f"{_INTERCEPTORS}=trace,{_INTERCEPTORS}::access_control=off,{_INTERCEPTORS}::low_pass=off"
)


def _common_settings(lease: float) -> dict[str, Any]:
    first, longest = RETRY_MS
    retry = {
        "period_init_ms": first,
        "period_max_ms": longest,
        "period_increase_factor": 2,
    }
    return {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "connect/timeout_ms": ATTEMPT_MS,
        "connect/exit_on_failure": False,
        "connect/retry": retry,
        "transport/link/tx/lease": round(lease * 1e3),
        "transport/link/tx/queue/size/data": BATCHES,
        "transport/shared_memory/enabled": False,
    }


def _client_settings(endpoint: str, lease: float) -> dict[str, Any]:
    return _common_settings(lease) | {
        "mode": "client",
        "listen/endpoints": [],
        "connect/endpoints": [endpoint],
    }


def _router_settings(endpoint: str, lease: float, links: Sequence[str] = ()) -> dict[str, Any]:
    size_filter = {
        "id": "largest-message",
        "flows": ["ingress", "egress"],
        "messages": ["put", "delete", "query", "reply"],
        "key_exprs": ["**"],
        "size_limit": MAX_PAYLOAD,
    }
    return _common_settings(lease) | {
        "mode": "router",
        "listen/endpoints": [endpoint],
        "connect/endpoints": [*links],
        "low_pass_filter": [size_filter],
        "transport/unicast/accept_timeout": ACCEPT_MS,
        "transport/unicast/accept_pending": MOST_PENDING,
    }


def _configured(settings: dict[str, Any], endpoint: str) -> Any:
    config = zenoh.Config()
    try:
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
    except zenoh.ZError:
        expected = "expected an endpoint such as tcp/127.0.0.1:7447"
        raise BusError(f"bus: found {endpoint!r}, {expected}") from None
    return config


def log_refusals() -> None:
    """Log refused connections and messages to standard output."""
    os.environ["RUST_LOG"] = _LOGGED
    zenoh.init_log_from_env_or("error")


def open_router(
    endpoint: str,
    lease: float = LEASE,
    secured: Mapping[str, Any] | None = None,
    links: Sequence[str] = (),
) -> Close:
    """Run a router that listens at `endpoint` until the returned function is called.

    Args:
        endpoint: such as tcp/127.0.0.1:7447.
        lease: silence after which a link counts as broken [s].
        secured: settings of certificates and access; none without keys.
        links: routers of other sites, each linked whenever it can be reached.

    Raises:
        BusError: an endpoint is not well formed, or this one already taken.
    """
    settings = _router_settings(endpoint, lease, links) | dict(secured or {})
    config = _configured(settings, ", ".join((endpoint, *links)))
    try:
        session = zenoh.open(config)
    except zenoh.ZError:
        taken = "is the address this machine's own, and free?"
        raise BusError(f"no router can listen at {endpoint}: {taken}") from None
    close: Close = session.close
    return close


def _reach(
    endpoint: str,
    timeout: float | None,
    lease: float,
    secured: Mapping[str, Any],
    stop: threading.Event | None = None,
) -> Any:
    """A session with the router at `endpoint`, with repeated attempts until `stop` is set."""
    started = time.monotonic()
    while True:
        try:
            settings = _client_settings(endpoint, lease) | dict(secured)
            return zenoh.open(_configured(settings, endpoint))
        except zenoh.ZError:
            waited = time.monotonic() - started
        if stop is not None and stop.is_set():
            raise NoRouterError(f"stopped before a router answered at {endpoint}")
        if timeout is not None and waited >= timeout:
            remedy = "start `rigwatch router` or correct bus.router"
            raise NoRouterError(f"no router answers at {endpoint}: {remedy}")


class _Line:
    """A key at which a session sends."""

    def __init__(self, session: Any, key: str) -> None:
        self._publisher = session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            reliability=zenoh.Reliability.RELIABLE,
        )
        self._info = zenoh.SourceInfo(self._publisher.id, 0)

    def put(self, payload: bytes, mark: bytes) -> None:
        """Send without waiting; dropped if the link is full or down."""
        with contextlib.suppress(zenoh.ZError):
            self._publisher.put(payload, source_info=self._info, attachment=mark or None)

    def undeclare(self) -> None:
        """Give up the key."""
        self._publisher.undeclare()


class _AttendedLine(_Line):
    """A line that follows whether anybody listens."""

    def __init__(self, session: Any, key: str) -> None:
        super().__init__(session, key)
        self._listened = False
        self._unsure_until: float | None = time.monotonic() + UNSURE
        self._told = self._publisher.declare_matching_listener(_direct(self._change))
        if self._publisher.matching_status.matching:
            self._listened = True

    def _change(self, status: Any) -> None:
        self._listened = status.matching

    def undeclare(self) -> None:
        """Give up the key."""
        self._told.undeclare()
        super().undeclare()

    @property
    def is_heard(self) -> bool:
        """Whether anybody listens, or the router has not had the time to tell."""
        if self._unsure_until is not None and time.monotonic() >= self._unsure_until:
            self._unsure_until = None
        return self._listened or self._unsure_until is not None


L = TypeVar("L", bound=_Line)


class _Channel:
    """What arrives at a key, kept by Zenoh until it is taken: the oldest gives way to the newest.

    A process of many rigs would otherwise be interrupted by each message, and its loop wait for the
    interpreter each time.
    """

    def __init__(self, session: Any, key: str, capacity: int) -> None:
        self._subscriber = session.declare_subscriber(key, RingChannel(capacity))
        self._handler = self._subscriber.handler

    def following(self) -> Received | None:
        """The next message; None if there is none."""
        try:
            sample = self._handler.try_recv()
        except zenoh.ZError:  # closed meanwhile
            return None
        return sample if sample is None else _received(sample)

    def undeclare(self) -> None:
        """Take no more."""
        self._subscriber.undeclare()


class _WaitingChannel(_Channel):
    """A channel for one reader."""

    def __init__(self, session: Any, key: str, receive: Receive) -> None:
        super().__init__(session, key, WAITING)
        self._receive, self._lock = receive, threading.Lock()

    def take(self) -> None:
        """Pass on what waits, in order."""
        with self._lock:
            for _ in range(WAITING):
                if (found := self.following()) is None:
                    return
                self._receive(*found)

    def may_hold(self) -> bool:
        """Only a look into it tells."""
        return True

    def keep_order(self) -> None:
        """Nothing overtakes what waits here."""


class ZenohTransport:
    """What one process does on one bus, over a Zenoh session.

    Args:
        session: connected to the router.
        leave: closes the session; None if it is not this transport's alone, which then takes back
            what it has declared.
        asking: held during a query.
        joint: what rigs that share the session have in common; None for a rig alone.
        keyless: whether the router has no keys: otherwise no role may speak for several rigs.
    """

    def __init__(
        self,
        session: Any,
        leave: Close | None = None,
        asking: AbstractContextManager[object] | None = None,
        joint: JointLink | None = None,
        *,
        keyless: bool = True,
    ) -> None:
        self._session, self._leave, self._keyless = session, leave, keyless
        self._asking = asking or contextlib.nullcontext()
        self._shared = threading.BoundedSemaphore(MOST_ASKED)
        self._joint = joint
        self._common = JointLink(self._attended, self._joint_channel)
        self._lines: dict[str, _Line] = {}
        self._outlets: dict[tuple[str, str], Alone | Among] = {}
        self._lock = threading.RLock()
        self._kept: list[Any] = []

    @classmethod
    def client(
        cls,
        endpoint: str,
        timeout: float | None = None,
        lease: float = LEASE,
        secured: Mapping[str, Any] | None = None,
        stop: threading.Event | None = None,
    ) -> "ZenohTransport":
        """A client of the router at `endpoint`, awaited for `timeout` [s], None: indefinitely.

        `stop` ends the wait within half a second.

        A link that is silent for `lease` [s] counts as broken; `secured` holds the settings of
        certificates, none without keys.

        Raises:
            BusError: the endpoint is not well formed, or no router answers there.
        """
        session = _reach(endpoint, timeout, lease, secured or {}, stop)
        return cls(session, session.close, keyless=not secured)

    def beside(self) -> "ZenohTransport":
        """Another transport over the same session, which it leaves open when it is closed."""
        return ZenohTransport(
            self._session, asking=self._shared, joint=self._common, keyless=self._keyless
        )

    def together(self) -> AbstractContextManager[None]:
        """Send what transports over the same session put meanwhile together."""
        return self._common.burst.held()

    def collect(self) -> None:
        """Hand to transports over the same session what has come in joined messages."""
        self._common.collect()

    @property
    def identity(self) -> str:
        """The session's id, which no other client can claim through Zenoh's interface."""
        return str(self._session.info.zid())

    def put(self, key: str, payload: bytes, mark: bytes = b"") -> None:
        """Send without waiting; dropped if the link is full or down."""
        line = self._lines.get(key) or self._line(key)
        if self._joint is None:
            line.put(payload, mark)
        else:
            self._joint.burst.add(lambda: line.put(payload, mark))

    def put_among(self, rig: str, key: str, payload: bytes, mark: bytes = b"") -> None:
        """The same, at a rig's key, among the messages of the other rigs of this process."""
        if not self._keyless:
            self.put(bus_key(rig, key), payload, mark)
            return
        outlet = self._outlets.get((rig, key)) or self._outlet(rig, key)
        outlet.put(payload, mark)

    def among(self, rig: str, key: str) -> Among | None:
        """What sends a rig's topic among those of other rigs; None if each is sent by itself."""
        if self._joint is None or not self._keyless:
            return None
        outlet = self._outlets.get((rig, key)) or self._outlet(rig, key)
        return outlet if isinstance(outlet, Among) else None

    def _line(self, key: str) -> _Line:
        with self._lock:
            if key not in self._lines:
                self._lines[key] = self._kept_line(_Line(self._session, key))
            return self._lines[key]

    def _attended(self, key: str) -> _AttendedLine:
        return self._kept_line(_AttendedLine(self._session, key))

    def _kept_line(self, line: L) -> L:
        self._kept.append(line)
        return line

    def _outlet(self, rig: str, key: str) -> Alone | Among:
        own = bus_key(rig, key)
        with self._lock:
            if (rig, key) not in self._outlets:
                self._outlets[rig, key] = (
                    Alone(self._line(own), self._attended(alone_key(own)))
                    if self._joint is None
                    else Among(
                        rig,
                        self._attended(own),
                        self._line(alone_key(own)),
                        self._joint.sender(key),
                        self._joint.burst,
                    )
                )
            return self._outlets[rig, key]

    def listen_from(self, key: str, receive: Receive) -> Close:
        """Call `receive` with each payload put to `key`, its sender and mark, in Zenoh's thread."""
        take = _direct(lambda sample: receive(*_received(sample)))
        return self._keep(self._session.declare_subscriber(key, take))

    def listen_waiting(self, key: str, receive: Receive) -> tuple[Waiting | None, Close]:
        """The same; where rigs share the session, messages wait in a channel of Zenoh's own."""
        if self._joint is None:
            return None, self.listen_from(key, receive)
        channel = _WaitingChannel(self._session, key, receive)
        return channel, self._keep(channel)

    def listen_among(self, rig: str, key: str, receive: Receive) -> tuple[Waiting | None, Close]:
        """The same, for what is sent with `put_among`."""
        own = bus_key(rig, key)
        if self._joint is None or not self._keyless:
            return self.listen_waiting(own, receive)
        alone = _Channel(self._session, alone_key(own), WAITING)
        share = self._joint.receiver(key).add(rig, receive, alone.following)
        ends = [self._keep(share), self._keep(alone)]

        def close() -> None:
            for end in ends:
                end()

        return share, close

    def _joint_channel(self, key: str) -> Following:
        channel = _Channel(self._session, key, JOINTS_WAITING)
        self._kept.append(channel)
        return channel.following

    def serve(self, key: str, answer: Answer) -> Close:
        """Answer queries to `key`, in a separate thread."""

        def reply(query: Any) -> None:
            with query:
                for payload in answered(answer, bytes(query.payload or b"")):
                    query.reply(query.key_expr, payload)

        return self._keep(self._session.declare_queryable(key, reply))

    def ask(self, key: str, question: bytes, timeout: float) -> list[bytes]:
        """The replies of all that serve `key` received within `timeout` [s]."""
        with self._asking, contextlib.suppress(zenoh.ZError):  # closed meanwhile
            replies = self._session.get(
                key,
                payload=question,
                timeout=timeout,
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
                congestion_control=zenoh.CongestionControl.DROP,
                priority=zenoh.Priority.DATA_HIGH,
            )
            return [reply.ok.payload.to_bytes() for reply in replies if reply.ok is not None]
        return []

    def declare_token(self, key: str) -> Close:
        """Declare a token at `key`, valid until closed or until this process ends."""
        return self._keep(self._session.liveliness().declare_token(key))

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        """Keys of the current tokens."""
        replies = self._session.liveliness().get(pattern, timeout=timeout)
        return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]

    def watch_tokens(self, pattern: str, changed: Callable[[str, bool], None]) -> Close:
        """Call `changed(key, alive)` for matching tokens, first for existing ones."""
        tell = _direct(lambda s: changed(str(s.key_expr), s.kind == zenoh.SampleKind.PUT))
        liveliness = self._session.liveliness()
        return self._keep(liveliness.declare_subscriber(pattern, tell, history=True))

    def connected(self) -> bool:
        """Whether there is currently a link to the router."""
        return not self._session.is_closed() and bool(self._session.info.routers_zid())

    def close(self) -> None:
        """Take back everything declared, with the session if it is this transport's alone."""
        if self._leave is not None:
            self._common.burst.close()
            self._leave()
            return
        if self._joint is not None:
            self._joint.burst.send()
        with self._lock:
            declared = [*self._kept]
            for kept in (self._kept, self._lines, self._outlets):
                kept.clear()
        for entity in declared:
            with contextlib.suppress(zenoh.ZError):
                entity.undeclare()

    def _keep(self, entity: Any) -> Close:
        # Zenoh undeclares an entity as soon as Python forgets it.
        self._kept.append(entity)

        def close() -> None:
            if entity in self._kept:
                self._kept.remove(entity)
                with contextlib.suppress(zenoh.ZError):
                    entity.undeclare()

        return close


def _received(sample: Any) -> Received:
    info, mark = sample.source_info, sample.attachment
    sender = "" if info is None else str(info.source_id.zid)
    return sample.payload.to_bytes(), sender, b"" if mark is None else mark.to_bytes()


def _direct(callback: Callable[[Any], None]) -> Any:
    """A callback that runs in Zenoh's receiving thread, which saves a thread switch per message."""
    return Callback(callback, indirect=False)
