"""A rig's latest signals and its alarms, buffered for the page."""

import math
import threading
from collections import deque
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.bus import (
    Bus,
    Subscription,
    ask_alarm_list,
    command_alarms,
    connect,
    unique_process,
)
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    SAMPLES,
    Alarm,
    AlarmCommand,
    EstimateBlock,
    SampleBlock,
    columns_of,
)
from rigwatch.wire.rig_config import load_rig

SECONDS = 20.0
"""Time span shown [s]."""
SHOWN_RATE = 64.0
"""Sample rate of the signals shown [Hz]."""
TIMEOUT = 2.0
SHOWN_ESTIMATES = ("residual", "theta1", "theta2")


class RigLink:
    """Subscribes to a rig; reconnects when the rig restarts.

    Args:
        config: the rig's configuration.

    Raises:
        ConfigError: it cannot be read.
    """

    def __init__(self, config: Path) -> None:
        self.config = load_rig(config)
        self._alarms: dict[str, Alarm] = {}
        self._trouble = "connecting to the rig"
        self._parts: dict[str, deque[tuple[FloatArray, dict[str, FloatArray]]]] = {
            "samples": deque(),
            "estimates": deque(),
        }
        self._units: dict[str, str] = {}
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="rig", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop receiving."""
        self._ended.set()
        self._thread.join(TIMEOUT)

    def seen(self) -> dict[str, Any]:
        """Latest signals, their units, alarms, and the fault of the link, if any."""
        with self._lock:
            signals = {kind: _joined(list(parts)) for kind, parts in self._parts.items()}
            alarms = [_plain(alarm) for alarm in self._alarms.values()]
            return {
                "rig": self.config.rig.id,
                "trouble": self._trouble,
                "signals": signals,
                "units": dict(self._units),
                "alarms": sorted(alarms, key=lambda a: (a["state"] == "normal", -a["t_ns"])),
            }

    def alarm(self, name: str) -> Alarm | None:
        """A received alarm."""
        with self._lock:
            return self._alarms.get(name)

    def command(self, command: AlarmCommand) -> tuple[list[Alarm], str]:
        """Send an operator's command; returns the changes, and the reason of a refusal.

        Raises:
            BusError: no monitor answers.
        """
        bus = connect(self.config, unique_process("workbench-ack"), TIMEOUT)
        try:
            return command_alarms(bus, command)
        finally:
            bus.close()

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                bus = connect(self.config, unique_process("workbench"), TIMEOUT)
            except BusError as error:
                self._say(str(error))
                self._ended.wait(TIMEOUT)
                continue
            try:
                self._listen(bus)
            finally:
                bus.close()

    def _listen(self, bus: Bus) -> None:
        alarms = bus.subscribe(ALARMS)
        blocks = [bus.subscribe(topic) for topic in (SAMPLES, ESTIMATES)]
        asked = False
        while not self._ended.is_set() and bus.connected():
            if not asked:
                asked = self._ask(bus)
            self._take(alarms, blocks)
            self._ended.wait(0.1)
        self._say("the rig's router is gone; waiting for it")

    def _ask(self, bus: Bus) -> bool:
        """The standing alarms, and whether a monitor replied."""
        try:
            standing = ask_alarm_list(bus, 0.3)
        except BusError as error:
            self._say(str(error))
            return False
        with self._lock:
            self._alarms = {alarm.name: alarm for alarm in standing} | self._alarms
            self._trouble = ""
        return True

    def _take(self, alarms: Subscription, blocks: list[Subscription]) -> None:
        changed = alarms.drain()
        heard = [block for subscription in blocks for block in subscription.drain()]
        with self._lock:
            self._alarms |= {alarm.name: alarm for alarm in changed}
            for block in heard:
                self._keep(block)

    def _keep(self, block: SampleBlock | EstimateBlock) -> None:
        kind = "samples" if isinstance(block, SampleBlock) else "estimates"
        every = max(1, round(self.config.rig.sample_rate / SHOWN_RATE))
        taken = slice(-block.seq % every, None, every)
        columns = [
            column
            for column in columns_of(block)
            if kind == "samples" or column.name in SHOWN_ESTIMATES
        ]
        self._units |= {column.name: column.unit for column in columns}
        times = np.asarray(block.t_ns[taken] / 1e9)
        parts = self._parts[kind]
        parts.append((times, {c.name: np.asarray(c.values[taken], float) for c in columns}))
        while parts and len(times) and len(parts[0][0]) and times[-1] - parts[0][0][-1] > SECONDS:
            parts.popleft()

    def _say(self, trouble: str) -> None:
        with self._lock:
            self._trouble = trouble


def _joined(parts: list[tuple[FloatArray, dict[str, FloatArray]]]) -> dict[str, Any]:
    names = parts[-1][1] if parts else {}
    same = [(times, columns) for times, columns in parts if columns.keys() == names.keys()]
    times = np.concatenate([t for t, _ in same]) if same else np.zeros(0)
    lines = {name: np.concatenate([columns[name] for _, columns in same]) for name in names}
    return {
        "times": times.tolist(),
        "lines": {name: _finite(values) for name, values in lines.items()},
    }


def _finite(values: FloatArray) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values.tolist()]


def _plain(alarm: Alarm) -> dict[str, Any]:
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in asdict(alarm).items()
    }
