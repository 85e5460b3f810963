"""Adapters are found by name, also those of others, and come back after errors."""

from collections.abc import Mapping, Sequence
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np
import pytest

import daq.adapters.registry
from daq.adapter import DeviceBusyError, RawBlock
from daq.adapters import adapter_for, known
from daq.supervisor import Supervisor
from rigwatch.wire.errors import DeviceError
from tests.daq.rig import Running, config_of


class Counting:
    """An adapter of somebody else: numbers of its own, in volts."""

    clock_rate = 1.0

    def __init__(self, options: Mapping[str, Any], channels: Sequence[Any]) -> None:
        self.step = options["step"]
        self.channels = len(channels)
        self.next = 0

    def open(self) -> None: ...

    def close(self) -> None: ...

    def counters(self) -> Mapping[str, float]:
        return {}

    def read(self, timeout: float) -> Sequence[RawBlock]:
        seq = np.array([self.next])
        self.next += 1
        codes = np.full((1, self.channels), self.next * self.step, float)
        return [RawBlock(1, seq, seq * 3906, codes, seq * 3906000)]


def test_the_four_built_in_adapters_are_entry_points() -> None:
    assert {"serial", "modbus-tcp", "modbus-rtu", "replay"} <= set(known())


def test_a_plugin_is_found_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("counting", "tests.daq.test_adapters:Counting", "rigwatch.adapters")
    monkeypatch.setattr(daq.adapters.registry, "entry_points", lambda group: [point])
    section = 'adapter = "plugin"\nname = "counting"\noptions = { step = 2.5 }'
    config = config_of(section, channels=2)
    running = Running(config, adapter_for(config.daq.device, config.channels))
    heard = running.more(3)
    values = [block.channel("voltage").values[0] for block in heard.blocks]
    assert values == [2.5, 5.0, 7.5]


def test_a_missing_plugin_is_named_beside_those_installed() -> None:
    config = config_of('adapter = "plugin"\nname = "labjack"')
    with pytest.raises(DeviceError, match=r"adapter .labjack. is not installed; found .*serial"):
        adapter_for(config.daq.device, config.channels)


def test_a_plugin_that_cannot_be_loaded_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("broken", "no_such_module:adapter", "rigwatch.adapters")
    monkeypatch.setattr(daq.adapters.registry, "entry_points", lambda group: [point])
    config = config_of('adapter = "plugin"\nname = "broken"')
    with pytest.raises(DeviceError, match=r"'broken' \(no_such_module:adapter\): No module named"):
        adapter_for(config.daq.device, config.channels)


class Absent(Counting):
    """A device that is away until `opens` attempts have been made."""

    def __init__(self, opens: int, error: type[DeviceError] = DeviceError) -> None:
        super().__init__({"step": 1.0}, [0])
        self.left = opens
        self.error = error

    def open(self) -> None:
        self.left -= 1
        if self.left >= 0:
            raise self.error("no device matches /dev/rig")


def test_waits_between_attempts_grow_to_one_second() -> None:
    waits = list[float]()
    device = Supervisor(Absent(8), clock=lambda: sum(waits), sleep=waits.append)
    device.start()
    assert device.text == "no device matches /dev/rig"
    while not device.connected:
        device.read(10.0)
    assert [wait for wait in waits if wait > 1e-9] == pytest.approx(
        [0.05, 0.1, 0.2, 0.4, 0.8, 1.0, 1.0, 1.0]
    )
    assert device.reconnects == 0


def test_a_device_in_use_ends_the_start() -> None:
    with pytest.raises(DeviceBusyError):
        Supervisor(Absent(1, DeviceBusyError)).start()
