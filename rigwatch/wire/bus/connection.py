"""Connects to a rig's bus over Zenoh, and runs its router.

Zenoh is slow to import and not needed for a bus in memory, so it is imported on first use.
"""

import contextlib
import logging
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from rigwatch.wire.access import (
    access_settings,
    certificate_name,
    check_exposure,
    keys_trouble,
    signer_of,
    tls_settings,
)
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.transport import Close
from rigwatch.wire.errors import BusError, KeysError, NoRouterError
from rigwatch.wire.rig_config import RigConfig

if TYPE_CHECKING:
    from rigwatch.wire.bus.zenoh_transport import ZenohTransport

_log = logging.getLogger(__name__)

ATTEMPT = 2.0
"""Longest that `joined` waits for a router before it looks at its event [s]."""
RINGS_MEGABYTES, LEAST_RING = 64.0, 4.0
"""Rings of the rigs of one process: of all together, and of each at least [MB]."""


class SharedLinks:
    """Links to routers that the rigs of one process use together: one for each router.

    A session has threads and buffers of its own, here and in the router, some megabytes for each.

    Args:
        rigs: number of rigs of the process, which share the memory of rings.
    """

    def __init__(self, rigs: int) -> None:
        self.ring_megabytes = max(LEAST_RING, RINGS_MEGABYTES / max(rigs, 1))
        self._lock = threading.Lock()
        self._places: dict[str, _Place] = {}

    def transport(
        self,
        endpoint: str,
        timeout: float | None,
        lease: float,
        tls: dict[str, Any],
        stop: threading.Event | None = None,
    ) -> "ZenohTransport":
        """A transport over the router's link, which is made if there is none.

        Raises:
            BusError: the router was not reached within `timeout` [s], or its endpoint is invalid.
        """
        with self._lock:
            place = self._places.setdefault(repr((endpoint, lease, sorted(tls.items()))), _Place())
        if not place.lock.acquire(timeout=-1 if timeout is None else timeout):
            reason = "another rig of this process waits"
            raise NoRouterError(f"no router answers at {endpoint}: {reason}")
        try:
            if place.link is None:
                place.link = _client(endpoint, timeout, lease, tls, stop)
            return place.link.beside()
        finally:
            place.lock.release()

    @contextlib.contextmanager
    def together(self) -> Iterator[None]:
        """Send what rigs put meanwhile together, at the end or if it has waited for too long."""
        with contextlib.ExitStack() as stack:
            for link in self._made():
                stack.enter_context(link.together())
            yield

    def collect(self) -> None:
        """Hand to each rig what has come for several."""
        for link in self._made():
            link.collect()

    def close(self) -> None:
        """Close the links, after all transports over them."""
        for link in self._made():
            link.close()

    def _made(self) -> list["ZenohTransport"]:
        return [place.link for place in tuple(self._places.values()) if place.link is not None]


class _Place:
    """The link to one router, and who may make it."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.link: ZenohTransport | None = None


def connect(
    config: RigConfig,
    process: str,
    timeout: float | None = None,
    links: SharedLinks | None = None,
    stop: threading.Event | None = None,
) -> Bus:
    """Join the bus of a rig as `process`.

    Args:
        config: the rig's configuration.
        process: name of the process, such as "daq".
        timeout: longest wait for the router [s]; None waits indefinitely, so processes can be
            started in any order. A router lost later is reconnected in the background.
        links: those of the process, if it serves several rigs.
        stop: ends the wait.

    Raises:
        BusError: the router was not reached within `timeout` or before `stop`, or its endpoint is
            invalid.
    """
    name = certificate_name(config.bus, process)
    tls = dict(tls_settings(config.bus, name))
    made = links.transport if links else _client
    try:
        transport = made(config.bus.router, timeout, config.bus.lease, tls, stop)
    except NoRouterError as error:
        # The refusal of a certificate looks to a client as if nobody were there.
        if why := keys_trouble(config.bus.security, name):
            raise NoRouterError(f"no connection to {config.bus.router}: {why}") from error
        raise
    signer = signer_of(config.bus.security, name)
    megabytes = config.bus.ring_megabytes
    if links:
        megabytes = min(megabytes, links.ring_megabytes)
    ring_bytes = round(megabytes * (1 << 20))
    return Bus(transport, config.rig.id, process, signer, ring_bytes, lease=config.bus.lease)


def _client(
    endpoint: str,
    timeout: float | None,
    lease: float,
    tls: dict[str, Any],
    stop: threading.Event | None = None,
) -> "ZenohTransport":
    from rigwatch.wire.bus.zenoh_transport import (
        ZenohTransport,  # slow to import, not needed in memory
    )

    return ZenohTransport.client(endpoint, timeout, lease, tls, stop)


@contextlib.contextmanager
def joined(
    config: RigConfig,
    process: str,
    stop: threading.Event,
    say: Callable[[str], None] | None = None,
    links: SharedLinks | None = None,
) -> Iterator[Bus | None]:
    """The bus of a rig, left at the end; None if `stop` is set before the router answers.

    Args:
        config: the rig's configuration.
        process: name of the process, such as "daq".
        stop: ends the wait.
        say: called once with one line if the router does not answer; the log if not given.
        links: those of the process, if it serves several rigs.

    Raises:
        BusError: the router's endpoint is invalid.
    """
    bus, say = None, say or _log.warning
    while bus is None and not stop.is_set():
        try:
            bus = connect(config, process, ATTEMPT, links, stop)
        except NoRouterError as error:
            if not stop.is_set():
                say(str(error))
            say = _say_nothing
            stop.wait(ATTEMPT / 2)
    try:
        yield bus
    finally:
        if bus is not None:
            bus.close()


def _say_nothing(_text: str) -> None:
    """Remarks after the first."""


def log_refusals() -> None:
    """Log refused connections and messages of this process's router to standard output."""
    from rigwatch.wire.bus import zenoh_transport

    zenoh_transport.log_refusals()


def open_router(config: RigConfig) -> Close:
    """Run the router of a rig's bus until the returned function is called.

    Raises:
        BusError: the endpoint is malformed or already in use.
        KeysError: a certificate or key is missing or cannot be used.
        ConfigError: the bus would be open to a network without keys.
    """
    from rigwatch.wire.bus import zenoh_transport

    check_exposure(config.bus)
    secured = tls_settings(config.bus, "router", listens=True) | access_settings(
        config.bus, config.rig.id
    )
    if config.bus.links:
        secured |= tls_settings(config.bus, "router")
    try:
        return zenoh_transport.open_router(
            config.bus.listen, config.bus.lease, secured, config.bus.links
        )
    except BusError:
        if why := keys_trouble(config.bus.security, "router"):
            raise KeysError(why) from None
        raise
