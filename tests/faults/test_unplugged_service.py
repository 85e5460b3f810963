"""A daq under systemd while its device is unplugged: it waits, says so, and keeps its watchdog fed.

The test stands where systemd does: at the socket of the notify protocol.
"""

import itertools
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from monitor.model.model_file import model_text
from rigwatch.demo.rig_file import write_rig_file
from rigwatch.wire.host import NO_SAMPLES, WAITS
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.typed_files.shipped import find_config
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device
from tests.daq.rig import ToySource, in_thread
from tests.monitor_process.model import MODEL
from tests.tooling.test_up import on_a_port_of_its_own
from tests.waiting import PATIENCE

WATCHDOG_S = 30.0
"""As in docker/systemd/rigwatch@.service; half of it is what systemd advises."""


class Systemd:
    """Listens to what a service reports."""

    def __init__(self, place: Path) -> None:
        self.place = place
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(place))
        self._socket.settimeout(0.5)
        self.fed_at: list[float] = []

    def until(self, holds: Callable[[str], bool], what: str) -> None:
        """Take in lines until one is as wanted."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            try:
                lines = self._socket.recv(4096).decode().splitlines()
            except TimeoutError:
                continue
            if "WATCHDOG=1" in lines:
                self.fed_at.append(time.monotonic())
            if any(map(holds, lines)):
                return
        raise AssertionError(f"not reported: {what}")


@pytest.fixture
def config(tmp_path: Path) -> Path:
    return on_a_port_of_its_own(write_rig_file(find_config("demo.toml"), tmp_path, "web"))


@contextmanager
def service(name: str, config: Path, systemd: Path | None = None, *options: str) -> Iterator[None]:
    """A process of the rig as systemd starts it."""
    environment = {**os.environ, **({"NOTIFY_SOCKET": str(systemd)} if systemd else {})}
    command = [sys.executable, "-m", "rigwatch", name, str(config), *options]
    with subprocess.Popen(command, env=environment) as running:
        try:
            yield
        finally:
            running.terminate()
            assert running.wait(timeout=60) == 0


def test_a_whole_rig_without_its_device_is_not_started_anew(config: Path, tmp_path: Path) -> None:
    systemd = Systemd(tmp_path / "notify")
    without = "--without=plant", "--without=dashboard", "--without=monitor"
    with service("up", config, systemd.place, *without):
        systemd.until(lambda line: line == "READY=1", "all are ready without the device")
        systemd.until(lambda line: line.startswith("STATUS=waits: "), "daq says that it waits")
        waited, fed = time.monotonic(), len(systemd.fed_at)
        systemd.until(lambda _: time.monotonic() - waited > 5.0, "it goes on")
        times = systemd.fed_at[fed:]
        assert max(b - a for a, b in itertools.pairwise(times)) < 0.5 * WATCHDOG_S
        server = SerialServer(Device(ToySource()), PtyLine(tmp_path / "serial-line"))
        with in_thread(server.run):
            systemd.until(lambda line: line == "STATUS=running", "the device is found")


@contextmanager
def silent_line(place: Path) -> Iterator[None]:
    """An adapter that is powered while the device behind it is not."""
    with ExitStack() as held:
        ends = os.openpty()
        for end in ends:
            held.callback(os.close, end)
        place.symlink_to(os.ttyname(ends[1]))
        held.callback(place.unlink)
        yield


@pytest.mark.nightly
def test_daq_and_monitor_of_a_device_that_is_switched_off_are_not_started_anew(
    config: Path, tmp_path: Path
) -> None:
    model = load_rig(config).monitor.model
    Path(model).write_text(model_text(MODEL))
    with ExitStack() as held:
        held.enter_context(silent_line(tmp_path / "serial-line"))
        held.enter_context(service("router", config))
        for name in ("daq", "monitor"):
            systemd = Systemd(tmp_path / name)
            held.enter_context(service(name, config, systemd.place))
            systemd.until(lambda line: line == f"STATUS={WAITS}{NO_SAMPLES}", "it waits")
            waited, fed = time.monotonic(), len(systemd.fed_at)
            systemd.until(lambda _, at=waited: time.monotonic() - at > 3.0, "it goes on")
            times = systemd.fed_at[fed:]
            assert max(b - a for a, b in itertools.pairwise(times)) < 0.5 * WATCHDOG_S


@pytest.mark.nightly
def test_a_daq_without_its_device_waits_and_is_not_restarted(config: Path, tmp_path: Path) -> None:
    systemd = Systemd(tmp_path / "notify")
    with ExitStack() as held:
        held.enter_context(service("router", config))
        held.enter_context(service("daq", config, systemd.place))
        systemd.until(lambda line: line == "READY=1", "it is ready without its device")
        systemd.until(lambda line: line.startswith("STATUS=waits: "), "it says that it waits")
        waited = time.monotonic()
        fed = len(systemd.fed_at)
        systemd.until(lambda _: time.monotonic() - waited > 5.0, "it goes on")
        times = systemd.fed_at[fed:]
        assert max(b - a for a, b in itertools.pairwise(times)) < 0.5 * WATCHDOG_S
        server = SerialServer(Device(ToySource()), PtyLine(tmp_path / "serial-line"))
        held.enter_context(in_thread(server.run))
        systemd.until(lambda line: line == "STATUS=running", "the device is found")
