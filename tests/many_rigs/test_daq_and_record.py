"""`rigwatch daq` and `rigwatch record` of several rigs on real lines, a real router and Modbus.

Two rigs on serial lines and one on Modbus are well at first. Of the others one has no router, one
no device, one a device with other channels, and one a device that does not answer.
"""

import json
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from daq.several import run_several
from rigwatch.recorder import run_several as record_several
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import EVENTS, Gap, SampleBlock
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session
from sim_plant.serve.line_faults import LineFaults
from sim_plant.serve.pty_line import PtyLine
from sim_plant.serve.serial_server import SerialServer
from sim_plant.serve.source import Device
from tests.bus.rig import ROOT, TestRig, answers, free_port, kill, stopped
from tests.daq.rig import ToySource, in_thread
from tests.waiting import PATIENCE, eventually

pytestmark = [pytest.mark.xdist_group("many-rigs"), pytest.mark.long]
WELL = ("left", "right", "modbus")


class Heard:
    """The samples of a rig as a reader gets them; all that is missing is reported as a gap."""

    def __init__(self, bus) -> None:
        self.reader, self.events = SampleReader(bus), bus.subscribe(EVENTS)
        self.numbers: dict[int, set[int]] = {}
        self.lost: dict[int, set[int]] = {}
        self.codes: list[str] = []
        self.count = 0

    def take(self) -> None:
        self.codes += [event.code for event in self.events.drain()]
        for item in self.reader.read(0.0):
            if isinstance(item, SampleBlock):
                found = set(range(item.seq, item.seq + len(item)))
                known = self.numbers.setdefault(item.boot, set())
                assert not found & known
                known |= found
                self.count += len(item)
            elif isinstance(item, Gap):
                self.lost.setdefault(item.boot, set()).update(range(item.first, item.last + 1))

    def unaccounted(self) -> list[int]:
        missing = []
        for boot, numbers in self.numbers.items():
            whole = set(range(min(numbers), max(numbers) + 1))
            missing += sorted(whole - numbers - self.lost.get(boot, set()))
        return missing


class Site:
    """A router, the devices, and the two processes that serve them all."""

    def __init__(self, folder: Path, held: ExitStack) -> None:
        self.folder, self.held = folder, held
        self.base = held.enter_context(TestRig(folder))
        self.base.router()
        self.unplugs = LineFaults()
        self.modbus_port = free_port()
        self.modbus = self.base.start("-m", "tests.daq.modbus_device", str(self.modbus_port))
        eventually(lambda: answers(self.modbus_port), "the Modbus device")
        self.silent = held.enter_context(socket.create_server(("127.0.0.1", 0)))
        self._line("left")
        self._line("right", self.unplugs)
        self._line("misfit")
        tcp = 'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {}'
        self.paths = [
            self._rig("left"),
            self._rig("silent", tcp.format(self.silent.getsockname()[1])),
            self._rig("misfit", channels=2),
            self._rig("nobody", 'adapter = "serial"\nport = "/dev/no-such-line"'),
            self._rig("routerless", router=free_port()),
            self._rig("right"),
            self._rig("modbus", tcp.format(self.modbus_port)),
        ]
        names = {path.stem: path for path in self.paths}
        self.heard = {n: Heard(self.base.bus("reader", load_rig(names[n]))) for n in WELL}
        self.misfit = self.base.bus("reader", load_rig(names["misfit"])).subscribe(EVENTS)
        self.daq = self.start_daq()

    def _line(self, name: str, faults: LineFaults | None = None) -> None:
        line = PtyLine(self.folder / name)
        server = SerialServer(Device(ToySource()), line, faults=faults)
        self.held.enter_context(in_thread(server.run))

    def _rig(self, name: str, device: str = "", channels: int = 3, router: int = 0) -> Path:
        path = self.folder / f"{name}.toml"
        serial = f'adapter = "serial"\nport = "{self.folder / name}"'
        tables = "".join(
            f'[[channels]]\nname = "c{n}"\nunit = "V"\ngain = 1.0\n' for n in range(channels)
        )
        port = router or self.base.listen
        path.write_text(
            f'[rig]\nid = "{name}"\n[bus]\nrouter = "tcp/127.0.0.1:{port}"\n{tables}'
            f"[daq.device]\n{device or serial}\n"
            f'[recorder]\nfolder = "{self.folder / "sessions"}"\nflush = 0.1\n'
        )
        return path

    def start_daq(self) -> "subprocess.Popen[bytes]":
        return self.base.start("-m", "rigwatch", "daq", *map(str, self.paths))

    def start_record(self) -> "subprocess.Popen[str]":
        words = ["-m", "rigwatch", "record", "--json", *map(str, self.paths)]
        started = subprocess.Popen(
            [sys.executable, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True
        )
        self.held.callback(started.kill)
        return started

    def go_on(self, *names: str, samples: int = 128) -> None:
        """So many more samples of each of these rigs come."""
        wanted = {name: self.heard[name].count + samples for name in names}

        def there() -> bool:
            for one in self.heard.values():
                one.take()
            return all(self.heard[name].count >= count for name, count in wanted.items())

        eventually(there, f"samples of {', '.join(names)}")

    def written(self, name: str, beyond: int = 0) -> int:
        """Size of what is recorded of a rig, once it is more than `beyond` [bytes]."""
        size = 0

        def grown() -> bool:
            nonlocal size
            self.go_on(samples=0)
            found = (self.folder / "sessions").glob(f"{name}-*/*.mcap")
            size = sum(path.stat().st_size for path in found)
            return size > beyond

        eventually(grown, f"the recording of {name}")
        return size


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Iterator[Site]:
    with ExitStack() as held:
        yield Site(tmp_path_factory.mktemp("site"), held)


def test_rigs_without_router_device_or_match_delay_none(site):
    site.go_on(*WELL)
    assert not any(one.lost for one in site.heard.values())
    event = site.misfit.get(PATIENCE)
    assert event.text == "the device sends 3 channels, the configuration has 2"


def test_a_device_that_hangs_delays_none_and_is_found_again(site):
    with stopped(site.modbus):
        eventually(
            lambda: site.go_on("left", "right", samples=64) or site.heard["modbus"].codes,
            "the silence of the Modbus device is reported",
        )
        site.go_on("left", "right")
    site.go_on(*WELL)
    assert not site.heard["left"].lost
    assert not site.heard["right"].lost


def test_a_line_that_is_unplugged_delays_none_and_is_found_again(site):
    site.unplugs.start("unplug", 256)
    eventually(
        lambda: (
            site.go_on("left", "modbus", samples=64) or "link_lost" in site.heard["right"].codes
        ),
        "the loss of the line is reported",
    )
    site.go_on(*WELL)
    assert not site.heard["left"].lost


@pytest.mark.nightly
def test_both_processes_are_killed_and_every_sample_is_accounted_for(site):
    recorder = site.start_record()
    for name in WELL:
        site.written(name)
    kill(site.daq)
    site.daq = site.start_daq()
    site.go_on(*WELL)
    kill(recorder)
    sizes = {name: site.written(name) for name in WELL}
    recorder = site.start_record()
    for name in WELL:
        site.written(name, sizes[name])
    site.go_on(*WELL)
    recorder.send_signal(signal.SIGTERM)
    said, _ = recorder.communicate(timeout=PATIENCE)
    assert recorder.returncode == 0
    folders = list(map(Path, json.loads(said)["sessions"]))
    site.go_on(*WELL)
    for name, one in site.heard.items():
        assert one.unaccounted() == []
        (folder,) = (folder for folder in folders if folder.name.startswith(f"{name}-"))
        assert_complete(folder, one)


def assert_complete(folder: Path, heard: Heard) -> None:
    """From its first sample on, the session has each that was delivered, once, and no other."""
    session = open_session(folder)
    found = [(b.boot, b.seq + at) for b in session.samples() for at in range(len(b))]
    assert len(set(found)) == len(found)
    delivered = [(boot, seq) for boot, numbers in heard.numbers.items() for seq in numbers]
    boot = found[0][0]
    within = [
        one for one in delivered if one[0] == boot and min(found)[1] <= one[1] <= max(found)[1]
    ]
    assert sorted(within) == sorted(found)


@pytest.mark.parametrize(
    "run", [run_several, lambda paths: record_several(paths, threading.Event())]
)
def test_two_configurations_of_one_rig_are_refused(run, tmp_path):
    path = TestRig(tmp_path).path
    twin = tmp_path / "twin.toml"
    twin.write_text(path.read_text())
    with pytest.raises(ConfigError, match=r"rig.id: found the same as in .*rig.toml"):
        run([path, twin])
