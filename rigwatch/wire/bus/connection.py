"""Connects to a rig's bus over Zenoh, and runs its router.

Zenoh is slow to import and not needed for a bus in memory, so it is imported on first use.
"""

import contextlib
import threading
from collections.abc import Callable, Iterator

from rigwatch.wire.access import (
    access_settings,
    certificate_name,
    check_exposure,
    signer_of,
    tls_settings,
)
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.transport import Close
from rigwatch.wire.errors import BusError
from rigwatch.wire.rig_config import RigConfig

ATTEMPT = 2.0
"""Longest that `joined` waits for a router before it looks at its event [s]."""


def connect(config: RigConfig, process: str, timeout: float | None = None) -> Bus:
    """Join the bus of a rig as `process`.

    Args:
        config: the rig's configuration.
        process: name of the process, such as "daq".
        timeout: longest wait for the router [s]; None waits indefinitely, so processes can be
            started in any order. A router lost later is reconnected in the background.

    Raises:
        BusError: the router was not reached within `timeout`, or its endpoint is invalid.
    """
    from rigwatch.wire.bus.zenoh_transport import (
        ZenohTransport,  # slow to import, not needed in memory
    )

    name = certificate_name(config.bus, process)
    tls = tls_settings(config.bus, name)
    transport = ZenohTransport.client(config.bus.router, timeout, config.bus.lease, tls)
    signer = signer_of(config.bus.security, name)
    ring_bytes = round(config.bus.ring_megabytes * (1 << 20))
    return Bus(transport, config.rig.id, process, signer, ring_bytes)


@contextlib.contextmanager
def joined(
    config: RigConfig, process: str, stop: threading.Event, say: Callable[[str], None]
) -> Iterator[Bus | None]:
    """The bus of a rig, left at the end; None if `stop` is set before the router answers.

    Args:
        config: the rig's configuration.
        process: name of the process, such as "daq".
        stop: ends the wait.
        say: called once with one line if the router does not answer.
    """
    bus = None
    while bus is None and not stop.is_set():
        try:
            bus = connect(config, process, ATTEMPT)
        except BusError as error:
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
        ConfigError: the bus would be open to a network without keys.
    """
    from rigwatch.wire.bus import zenoh_transport

    check_exposure(config.bus)
    secured = tls_settings(config.bus, "router", listens=True) | access_settings(
        config.bus, config.rig.id
    )
    if config.bus.links:
        secured |= tls_settings(config.bus, "router")
    return zenoh_transport.open_router(
        config.bus.listen, config.bus.lease, secured, config.bus.links
    )
