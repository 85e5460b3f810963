"""The router as a process: it listens until a signal ends it, and follows the register of keys."""

import threading
import time
from pathlib import Path
from typing import Any

from rigwatch.router.refusal_log import RefusalLog
from rigwatch.router.report import RouterReport
from rigwatch.wire.access import REGISTER, access_settings
from rigwatch.wire.bus import Close, open_router
from rigwatch.wire.errors import BusError, KeysError
from rigwatch.wire.host import Heartbeat, keep_memory_tidy, use_few_pools
from rigwatch.wire.rig_config import RigConfig

TURN = 0.25
"""Time between two checks of the register and notifications to the supervisor [s]."""
REOPENING = 10.0
"""Longest time until the address is free again [s]."""


class FollowedRouter:
    """Zenoh's router, opened again when the register allows other certificates.

    Zenoh reads its access list only when it is opened. Links are interrupted for about a second;
    processes reconnect by themselves and fetch from the rings what they missed.

    Args:
        config: the rig's configuration.

    Attributes:
        trouble: why the register could not be read, otherwise "".
    """

    def __init__(self, config: RigConfig) -> None:
        self.trouble = ""
        self._config = config
        # Read before the router reads it: a change in between is seen later.
        self._stamp = self._stamped()
        self._access = access_settings(config.bus, config.rig.id)
        self._close: Close = open_router(config)

    def follow(self) -> bool:
        """Check the register; returns whether the router was opened again.

        Raises:
            BusError: the address could not be taken again.
        """
        stamp = self._stamped()
        if stamp == self._stamp:
            return False
        try:
            access = access_settings(self._config.bus, self._config.rig.id)
        except KeysError as error:
            self.trouble = f"{error}; the access list remains as it was"
            return False
        self._stamp, self.trouble = stamp, ""
        if access == self._access:
            return False
        self._close()
        self._close, self._access = _opened(self._config), access
        return True

    def close(self) -> None:
        """Stop routing."""
        self._close()

    def _stamped(self) -> Any:
        """Changes whenever the register does."""
        if not (keys := self._config.bus.security.keys):
            return None
        try:
            found = (Path(keys) / REGISTER).stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size, found.st_ino


def _opened(config: RigConfig) -> Close:
    deadline = time.monotonic() + REOPENING
    while True:
        try:
            return open_router(config)
        except BusError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


def run(config: RigConfig, stop: threading.Event) -> None:
    """Route until `stop` is set.

    Raises:
        RigwatchError: the address is taken, or there are no valid keys.
    """
    use_few_pools()
    refusals = RefusalLog()
    refusals.open()
    try:
        _route(config, refusals, stop)
    finally:
        refusals.close()


def _route(config: RigConfig, refusals: RefusalLog, stop: threading.Event) -> None:
    heartbeat, report = Heartbeat("router"), RouterReport(config, refusals, stop)
    router = FollowedRouter(config)
    # A headquarters without keys has the name of its site's router, which reports itself.
    if config.bus.security.keys or not config.bus.links:
        report.start()
    keep_memory_tidy(stop)
    heartbeat.ready(f"listens at {config.bus.listen}")
    # Samples do not pass through this loop.
    while not stop.wait(TURN):
        if router.follow():
            report.reloads += 1
        report.trouble = router.trouble
        heartbeat.advance(0)
    heartbeat.stopping()
    report.finish()
    router.close()
