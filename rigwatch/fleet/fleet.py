"""Polls many rigs at once."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rigwatch.fleet.rig_state import RigState, judged, unreachable
from rigwatch.wire.bus import Bus, Subscription, ask_alarm_list, connect, unique_process
from rigwatch.wire.errors import BusError, ConfigError, RigwatchError
from rigwatch.wire.messages import ALIVE_KEY, HEALTH, Alarm, Health, is_remembered
from rigwatch.wire.rig_config import RigConfig, load_rig
from rigwatch.wire.several_rigs import apart, valid_rigs

MOST_AT_ONCE = 64
"""Rigs that are asked at the same time."""
SILENT_S = 2.5
"""Time without a message of health, which comes every second, after which a process hangs [s]."""
NEXT_WITHIN_S = 1.5
"""Time within which a process that is well says the next one [s]."""
_PROCESSES = ("monitor", "recorder", "witness")


class Onlooker:
    """One rig, as seen from outside.

    Args:
        path: its configuration.
        config: the same, loaded.
        timeout: longest wait for its router, and for an answer [s].
    """

    def __init__(self, path: Path, config: RigConfig, timeout: float) -> None:
        self._path, self._config, self._timeout = path, config, timeout
        self._bus: Bus | None = None
        self._healths: Subscription | None = None
        self._last: dict[str, Health] = {}
        self._heard_at: dict[str, float] = {}
        self._hung: set[str] = set()

    def state(self) -> RigState:
        """The present state."""
        rig, path = self._config.rig.id, str(self._path)
        try:
            bus = self._joined()
        except RigwatchError as error:  # no router, or keys that cannot be read
            return unreachable(rig, path, str(error))
        if not bus.connected():
            return unreachable(rig, path, f"the router at {self._config.bus.router} is away")
        there = set(bus.tokens(f"{ALIVE_KEY}/*", self._timeout))
        expected = self._expected()
        present = {name for name in expected if f"{ALIVE_KEY}/{name}" in there}
        self._hear(present)
        # The router takes a silent process for gone after a while; one that ends is gone at once.
        self._hung = self._silent(present) | (self._hung - present)
        alarms = self._alarms(bus) if "monitor" in present - self._hung else []
        missing = [name for name in expected if name not in present | self._hung]
        hung = [name for name in expected if name in self._hung]
        return judged(rig, path, missing, alarms, self._last, hung=hung)

    def _alarms(self, bus: Bus) -> list[Alarm] | None:
        """The standing alarms; None if its monitor does not tell them."""
        try:
            return ask_alarm_list(bus, self._timeout)
        except BusError:
            return None

    def _silent(self, present: set[str]) -> set[str]:
        """Processes that hold their place on the bus and have said nothing for too long."""
        now = time.monotonic()
        return {name for name in present if now - self._heard_at[name] > SILENT_S}

    def _joined(self) -> Bus:
        if self._bus is None:
            self._bus = connect(self._config, unique_process("fleet"), self._timeout)
            self._healths = self._bus.subscribe(HEALTH)
        return self._bus

    def _expected(self) -> list[str]:
        """Processes that the configuration has."""
        return ["daq", *(name for name in _PROCESSES if getattr(self._config, name) is not None)]

    def _hear(self, present: set[str]) -> None:
        """Take the messages of health; wait for one of each process not heard yet, or just back."""
        assert self._healths is not None
        now = time.monotonic()
        for name in set(self._heard_at) - present:
            del self._heard_at[name]  # its time begins anew when it comes back
        for name in present:
            self._heard_at.setdefault(name, now)
        for health in self._healths.drain():
            self._take(health)
        self._wait(lambda: present - set(self._last), now + self._timeout)
        # Between two looks it may have been away, and have only just come back.
        self._wait(
            lambda: self._silent(present) - self._hung, now + min(self._timeout, NEXT_WITHIN_S)
        )

    def _wait(self, unheard: Callable[[], set[str]], until: float) -> None:
        """Wait for messages of health of these until a monotonic time [s]."""
        assert self._healths is not None
        while unheard() and (left := until - time.monotonic()) > 0:
            if (health := self._healths.get(timeout=left)) is not None:
                self._take(health)

    def _take(self, health: Health) -> None:
        name = health.source.partition("/")[0]
        if name in self._heard_at or is_remembered(self._last, name):
            self._last[name], self._heard_at[name] = health, time.monotonic()

    def close(self) -> None:
        """Leave the rig's bus."""
        if self._bus is not None:
            self._bus.close()


class Fleet:
    """The rigs of several configurations; one that is wrong is a rig of which nothing is known.

    Args:
        paths: the configurations.
        timeout: longest wait for a rig [s].

    Raises:
        ConfigError: all configurations are invalid, or two are of one rig on one router.
    """

    def __init__(self, paths: Sequence[Path], timeout: float) -> None:
        self._timeout = timeout
        self._loaded = valid_rigs(paths)
        self._rigs = [Onlooker(path, config, timeout) for path, config in self._loaded]
        right = {path for path, _ in self._loaded}
        self._wrong = [path for path in paths if path not in right]
        self._threads = ThreadPoolExecutor(min(MOST_AT_ONCE, max(1, len(paths))))

    def states(self) -> list[RigState]:
        """The present state of each rig, the worst first; those alike by name."""
        unknown = [state for path in tuple(self._wrong) if (state := self._load(path))]
        states = [*unknown, *self._threads.map(Onlooker.state, self._rigs)]
        return sorted(states, key=lambda state: (-state.rank, state.rig))

    def _load(self, path: Path) -> RigState | None:
        """The state of a rig whose configuration is wrong; None if it has been mended."""
        try:
            loaded = apart([*self._loaded, (path, load_rig(path))])
        except ConfigError as error:
            return unreachable(path.name, str(path), str(error))
        self._loaded = loaded
        self._wrong.remove(path)
        self._rigs.append(Onlooker(*loaded[-1], self._timeout))
        return None

    def close(self) -> None:
        """Leave all buses."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        for rig in self._rigs:
            rig.close()
