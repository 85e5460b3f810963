"""`rigwatch up` with the real router, simulated rig and acquisition on a real serial line."""

import contextlib
import json
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rigwatch.demo.rig_file import write_rig_file
from rigwatch.wire.host.ports import endpoint_address, free_port
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.typed_files.shipped import find_config
from sim_plant.serve import ControlServer, control_path
from tests.waiting import eventually, runs

pytestmark = pytest.mark.xdist_group("rig")
WITHOUT = ["--without", "monitor", "--without", "recorder", "--without", "dashboard"]
Events = list[dict[str, Any]]


class Rig:
    """A running `rigwatch up --json`; its command follows after `before`."""

    def __init__(self, config: Path, *more: str, before: tuple[str, ...] = ()) -> None:
        self.config = config
        self.events: Events = []
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.process = subprocess.Popen(
            [*before, sys.executable, "-m", "rigwatch", "up", "--json", *more, str(config)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line)

    def wait_for(self, kind: str, timeout: float = 60.0, **wanted: Any) -> dict[str, Any]:
        """The next event of a kind with these fields."""
        deadline = time.monotonic() + timeout
        while (left := deadline - time.monotonic()) > 0:
            try:
                line = self._lines.get(timeout=left)
            except queue.Empty:
                break
            assert line.startswith("{"), f"found {line!r}, expected an event"
            event = json.loads(line)
            self.events.append(event)
            if event["event"] == kind and all(event.get(k) == v for k, v in wanted.items()):
                return dict(event)
        raise AssertionError(f"no {kind} {wanted} within {timeout} s: {self.events[-8:]}")

    def flows(self, process: str, more_than: float = 200.0) -> dict[str, Any]:
        """The state of all processes once samples go through one at nearly the full rate."""
        while True:
            status = self.wait_for("status")["processes"]
            if status[process]["rate"] > more_than:
                return dict(status)

    def end(self) -> int:
        """Stop in good order; the exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=40)


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return write_rig_file(find_config("demo.toml"), tmp_path, "web")


def on_a_port_of_its_own(config: Path) -> Path:
    """The rig where no other test's demo is: a demo takes its usual port if that is free."""
    bus = endpoint_address(load_rig(config).bus.listen)
    assert bus is not None
    text = config.read_text(encoding="utf-8").replace(str(bus[1]), str(free_port()))
    config.write_text(text, encoding="utf-8")
    return config


@pytest.fixture
def rig(config: Path) -> Iterator[Rig]:
    running = Rig(on_a_port_of_its_own(config), *WITHOUT)
    yield running
    if running.process.poll() is None:
        running.process.terminate()
        running.process.wait(timeout=40)


def test_killed_and_hung_processes_come_back_and_the_rest_goes_on(rig: Rig) -> None:
    before = rig.flows("daq")
    os.kill(before["daq"]["pid"], signal.SIGKILL)
    again = rig.wait_for("started", process="daq", restarts=1)
    rig.flows("daq")

    os.kill(again["pid"], signal.SIGSTOP)
    assert "hangs" in rig.wait_for("ill", process="daq")["text"]
    rig.wait_for("started", process="daq", restarts=2)
    after = rig.flows("daq")

    assert after["plant"]["pid"] == before["plant"]["pid"]
    assert after["router"]["pid"] == before["router"]["pid"]
    assert after["daq"]["total"] > before["daq"]["total"]

    assert rig.end() == 0
    pids = [process["pid"] for process in after.values()]
    assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]


def test_a_second_start_of_the_same_rig_is_refused_in_one_line(rig: Rig) -> None:
    rig.wait_for("ready", process="router")
    second = subprocess.run(
        [sys.executable, "-m", "rigwatch", "up", str(rig.config), *WITHOUT],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert second.returncode == 2
    (line,) = second.stderr.strip().splitlines()
    assert "in use: is this rig up already?" in line


def test_no_process_outlives_a_supervisor_that_was_killed(rig: Rig) -> None:
    rig.wait_for("ready", process="router")
    rig.wait_for("ready", process="plant")
    pids = [event["pid"] for event in rig.events if event["event"] == "started"]
    rig.process.kill()
    eventually(lambda: not any(runs(pid) for pid in pids), "every process has ended")


def test_beside_a_rig_that_is_up_another_gets_ports_and_a_name_of_its_own(
    config: Path, tmp_path: Path
) -> None:
    first = load_rig(config)
    address = endpoint_address(first.bus.listen)
    assert address is not None
    with socket.create_server(address):
        second = load_rig(write_rig_file(find_config("demo.toml"), tmp_path, "web"))
    assert second.bus.listen != first.bus.listen
    assert second.rig.id != first.rig.id


def test_beside_a_simulated_rig_of_its_name_a_demonstration_gets_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    source = tmp_path / "demo.toml"
    port = f"{free_port()}"
    source.write_text(find_config("demo.toml").read_text().replace("7447", port))
    names = []
    with contextlib.ExitStack() as running:
        for _ in range(3):
            rig = load_rig(write_rig_file(source, tmp_path, "web")).rig.id
            running.enter_context(ControlServer(control_path(rig), lambda line: line))
            names.append(rig)
    assert names == ["demo", f"demo-{port}", f"demo-{port}-2"]
