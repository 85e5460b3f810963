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
from typing import Any

import zenoh
from zenoh.handlers import Callback, RingChannel

from rigwatch.wire.bus.burst import Burst
from rigwatch.wire.bus.transport import MAX_PAYLOAD, Answer, Close, Receive, Take, answered
from rigwatch.wire.errors import BusError, NoRouterError

RETRY_MS = (100, 200)
BATCHES = 16
"""Batches of 64 kB that wait for a slow link before messages are dropped: rigs share a link, and
with two, Zenoh's own number, a reader that pauses for 80 ms loses messages of twenty-four.
"""
MOST_ASKED = 4
"""Queries at a time over a link that rigs share: after a stall all ask at once, and answers that
come too late would be asked for again, without end.
"""
WAITING = 256
"""Messages of a topic that wait for a process of several rigs: nine seconds of samples."""
LEASE = 10.0
"""Silence after which a link counts as broken [s]."""
ACCEPT_MS, MOST_PENDING = 1000, 1000
"""Router's time limit for a connection to identify itself [ms], and number of pending ones."""
ATTEMPT_MS = 300
"""Time of one connection attempt [ms]; short, since signals are handled only between attempts."""
_INTERCEPTORS = "zenoh::net::routing::interceptor"
_LOGGED = (
    "zenoh=error,zenoh_link_tls=warn,"
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


class ZenohTransport:
    """What one process does on one bus, over a Zenoh session.

    Args:
        session: connected to the router.
        leave: closes the session; None if it is not this transport's alone, which then takes back
            what it has declared.
        asking: held during a query.
        burst: sends what rigs that share the session put; None sends at once.
    """

    def __init__(
        self,
        session: Any,
        leave: Close | None = None,
        asking: AbstractContextManager[object] | None = None,
        burst: Burst | None = None,
    ) -> None:
        self._session, self._leave = session, leave
        self._asking = asking or contextlib.nullcontext()
        self._shared = threading.BoundedSemaphore(MOST_ASKED)
        self._burst = burst
        self._gathered = Burst()
        self._publishers: dict[str, Any] = {}
        self._lock = threading.Lock()
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
        return cls(session, session.close)

    def beside(self) -> "ZenohTransport":
        """Another transport over the same session, which it leaves open when it is closed."""
        return ZenohTransport(self._session, asking=self._shared, burst=self._gathered)

    def together(self) -> AbstractContextManager[None]:
        """Send what transports over the same session put meanwhile together."""
        return self._gathered.held()

    @property
    def identity(self) -> str:
        """The session's id, which no other client can claim through Zenoh's interface."""
        return str(self._session.info.zid())

    def put(self, key: str, payload: bytes, mark: bytes = b"") -> None:
        """Send without waiting; dropped if the link is full or down."""
        publisher, info = self._publishers.get(key) or self._declare_publisher(key)

        def send() -> None:
            with contextlib.suppress(zenoh.ZError):
                publisher.put(payload, source_info=info, attachment=mark or None)

        if self._burst is None:
            send()
        else:
            self._burst.add(send)

    def _declare_publisher(self, key: str) -> Any:
        with self._lock:
            if key not in self._publishers:
                publisher = self._session.declare_publisher(
                    key,
                    congestion_control=zenoh.CongestionControl.DROP,
                    reliability=zenoh.Reliability.RELIABLE,
                )
                self._publishers[key] = publisher, zenoh.SourceInfo(publisher.id, 0)
            return self._publishers[key]

    def listen_from(self, key: str, receive: Receive) -> Close:
        """Call `receive` with each payload put to `key`, its sender and mark, in Zenoh's thread."""
        take = _direct(lambda s: receive(s.payload.to_bytes(), _sender(s), _mark(s)))
        return self._keep(self._session.declare_subscriber(key, take))

    def listen_waiting(self, key: str, receive: Receive) -> tuple[Take | None, Close]:
        """The same; where rigs share the session, messages wait in a channel of Zenoh's own.

        A process of many rigs would otherwise be interrupted by each message, and its loop wait for
        the interpreter each time.
        """
        if self._burst is None:
            return None, self.listen_from(key, receive)
        subscriber = self._session.declare_subscriber(key, RingChannel(WAITING))
        channel, lock = subscriber.handler, threading.Lock()

        def take() -> None:
            with lock:
                for _ in range(WAITING):
                    try:
                        sample = channel.try_recv()
                    except zenoh.ZError:  # closed meanwhile
                        return
                    if sample is None:
                        return
                    receive(sample.payload.to_bytes(), _sender(sample), _mark(sample))

        return take, self._keep(subscriber)

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
            self._gathered.close()
            self._leave()
            return
        if self._burst is not None:
            self._burst.send()
        with self._lock:
            declared = [*self._kept, *(publisher for publisher, _ in self._publishers.values())]
            self._kept.clear()
            self._publishers.clear()
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


def _sender(sample: Any) -> str:
    info = sample.source_info
    return "" if info is None else str(info.source_id.zid)


def _mark(sample: Any) -> bytes:
    return b"" if sample.attachment is None else bytes(sample.attachment.to_bytes())


def _direct(callback: Callable[[Any], None]) -> Any:
    """A callback that runs in Zenoh's receiving thread, which saves a thread switch per message."""
    return Callback(callback, indirect=False)
