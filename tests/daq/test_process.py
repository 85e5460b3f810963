"""The acquisition process: on the bus, in the ring, and refused where it cannot run."""

import threading
from pathlib import Path

import pytest

from daq.__main__ import acquire
from daq.adapter import DeviceBusyError
from daq.adapters import adapter_for
from daq.adapters.serial_line import SerialPort
from rigwatch.commands import main
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.host import Heartbeat
from rigwatch.wire.messages.topics import EVENTS, HEALTH, RING_KEY, SAMPLES
from rigwatch.wire.ordering.ring_protocol import Ask, RingReply
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device
from tests.daq.rig import ToySource, config_of, in_thread


def test_samples_are_published_kept_and_reported(tmp_path: Path) -> None:
    config = config_of(f'adapter = "serial"\nport = "{tmp_path / "rig"}"')
    network = MemoryNetwork()
    reader = network.bus("test", "reader")
    samples, health = reader.subscribe(SAMPLES), reader.subscribe(HEALTH)
    server = SerialServer(Device(ToySource()), PtyLine(tmp_path / "rig"))
    adapter = adapter_for(config.daq.device, config.channels)
    bus = network.bus("test", "daq")
    with (
        in_thread(server.run),
        in_thread(lambda stop: acquire(config, adapter, bus, stop, Heartbeat("daq", {}))),
    ):
        first = samples.get(30.0)
        while (latest := health.get(30.0)).state != "running":
            pass
        ask = Ask(first.boot, first.seq, first.seq)
        (reply,) = reader.query(RING_KEY, ask.to_bytes())
    assert latest.counters["good_frames"] > 0
    (kept,) = RingReply.from_bytes(reply).blocks
    assert (kept.boot, kept.seq) == (first.boot, first.seq)


def test_a_frozen_reader_holds_up_nothing(tmp_path: Path) -> None:
    config = config_of(f'adapter = "serial"\nport = "{tmp_path / "rig"}"')
    network = MemoryNetwork()
    frozen = network.bus("test", "frozen").subscribe(SAMPLES, capacity=4)
    events = network.bus("test", "reader").subscribe(EVENTS)
    live = network.bus("test", "live").subscribe(SAMPLES)
    server = SerialServer(Device(ToySource()), PtyLine(tmp_path / "rig"))
    adapter = adapter_for(config.daq.device, config.channels)
    bus = network.bus("test", "daq")
    with (
        in_thread(server.run),
        in_thread(lambda stop: acquire(config, adapter, bus, stop, Heartbeat("daq", {}))),
    ):
        received = 0
        while received < 60:
            received += len(live.get(30.0))
    assert frozen.dropped > 0
    assert not [event for event in events.drain() if event.code == "gap"]


def test_a_second_start_is_refused(tmp_path: Path) -> None:
    with PtyLine(tmp_path / "rig"):
        first = SerialPort(str(tmp_path / "rig"), 115200)
        first.open()
        config = config_of(f'adapter = "serial"\nport = "{tmp_path / "rig"}"')
        adapter = adapter_for(config.daq.device, config.channels)
        bus = MemoryNetwork().bus("test", "daq")
        with pytest.raises(DeviceBusyError, match="in use by another process"):
            acquire(config, adapter, bus, threading.Event(), Heartbeat("daq", {}))
        first.close()


def test_a_scenario_is_recorded_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = Path(__file__).parents[2] / "configs" / "scenarios" / "healthy_sine_8hz_1v4.toml"
    out = tmp_path / "out.mcap"
    assert main(["plant", "--session", str(out), str(scenario), "--seconds", "2", "--json"]) == 0
    assert '"samples": 512' in capsys.readouterr().out
    assert out.stat().st_size > 1000


@pytest.mark.parametrize("command", [["plant", "--effects"], ["plant"], ["daq"]])
def test_errors_are_one_plain_line(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "rig.toml"
    config.write_text('[rig]\nid = "nobody-here"\n')
    assert main([command[0], str(config), *command[1:]]) == 2
    error = capsys.readouterr().err
    assert error.startswith("rigwatch: ")
    assert error.count("\n") == 1
