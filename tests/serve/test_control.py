"""People change the rig while it runs, and are told plainly when that cannot be."""

import contextlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import DeviceError
from sim_plant.effects import EFFECTS
from sim_plant.scenario import ScenarioRun, load_scenario
from sim_plant.serve.commands import Commands, Controlled
from sim_plant.serve.control import ControlServer, ask
from sim_plant.serve.line_faults import LineFaults
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device
from tests.daq.rig import in_thread

SCENARIO = Path(__file__).parents[2] / "configs" / "scenarios" / "healthy_sine_8hz_1v4.toml"


@pytest.fixture
def running(tmp_path: Path) -> Iterator[tuple[Path, ScenarioRun, Device, LineFaults]]:
    run = ScenarioRun(load_scenario(SCENARIO), seed=1)
    plant = Controlled(run, run.rig)
    device, faults = Device(plant), LineFaults()
    neutral = {name: effect.neutral for name, effect in EFFECTS.items()}
    server = SerialServer(device, PtyLine(tmp_path / "rig"), faults=faults)
    path = tmp_path / "control"
    commands = Commands(plant, device, faults, neutral)
    with in_thread(server.run), ControlServer(path, commands.answer):
        yield path, run, device, faults


def test_effects_are_set_listed_and_cleared(
    running: tuple[Path, ScenarioRun, Device, LineFaults],
) -> None:
    path, run, _, _ = running
    assert ask(path, "set friction=0.4") == "friction=0.4"
    assert run.rig.effects["coulomb"] == 0.4
    assert "coulomb=0.4" in ask(path, "effects").split()
    assert ask(path, "clear") == "coulomb"
    assert run.rig.effects["coulomb"] == 0.0
    assert ask(path, "set viscous=2 over 60") == "viscous=2"
    assert run.rig.effects["viscous"] < 2.0


def test_device_and_line_are_troubled(
    running: tuple[Path, ScenarioRun, Device, LineFaults],
) -> None:
    path, _, device, faults = running
    boot = device.boot
    assert ask(path, "restart") == f"boot {device.boot:08x}"
    assert device.boot != boot
    assert ask(path, "clock +0.5") == "clock +0.5 s"
    assert ask(path, "fault lose 0") == "lose"
    assert faults.apply(b"frame\0") == b""
    assert ask(path, "heal") == "the line is sound"
    assert faults.apply(b"frame\0") == b"frame\0"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("set frction=0.4", "found 'frction'"),
        ("set friction=much", "'much': expected a number"),
        ("set friction", "expected set NAME=VALUE"),
        ("set friction=nan", "expected a finite number"),
        ("fault gremlins", "expected one of garbage"),
        ("dance", "'dance': expected one of set, clear"),
        ("", "'': expected one of"),
    ],
)
def test_nonsense_is_refused_in_plain_words(
    running: tuple[Path, ScenarioRun, Device, LineFaults], line: str, message: str
) -> None:
    with pytest.raises(DeviceError, match=message):
        ask(running[0], line)


def test_a_second_plant_of_the_same_rig_is_refused_with_the_process_that_holds_its_place(
    tmp_path: Path,
) -> None:
    with (
        ControlServer(tmp_path / "control", lambda line: ""),
        pytest.raises(DeviceError, match=rf"runs already: process {os.getpid()} \(.*pytest"),
        ControlServer(tmp_path / "control", lambda line: ""),
    ):
        pass


def test_a_plant_that_hangs_holds_its_place_and_nobody_waits_for_it(tmp_path: Path) -> None:
    path = tmp_path / "control"
    with socket.socket(socket.AF_UNIX) as hangs, contextlib.ExitStack() as queue:
        hangs.bind(str(path))
        hangs.listen(0)
        queue.enter_context(socket.socket(socket.AF_UNIX)).connect(str(path))
        with pytest.raises(DeviceError, match="a process that hangs"):
            ControlServer(path, lambda line: "").__enter__()


def test_a_place_where_no_socket_can_be_is_said_plainly(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="cannot listen here"):
        ControlServer(tmp_path / ("long" * 30), lambda line: "").__enter__()


def test_no_plant_is_reported_plainly(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="no simulated rig answers"):
        ask(tmp_path / "nobody", "effects")


def test_a_socket_that_a_dead_plant_left_is_replaced(tmp_path: Path) -> None:
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(tmp_path / "control"))
    left.close()
    with ControlServer(tmp_path / "control", lambda line: f"heard {line}"):
        assert ask(tmp_path / "control", "hello") == "heard hello"


def test_codes_are_those_of_the_scenario(tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIO)
    run, twin = ScenarioRun(scenario, seed=3), ScenarioRun(scenario, seed=3)
    device = Device(Controlled(run, run.rig))
    sent = np.concatenate([device.advance(n).codes for n in (1, 7, 100)])
    np.testing.assert_array_equal(sent, twin.advance(108).codes)
