"""Another Modbus device in the place of the right one: real servers at one place, daq, monitor."""

import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import msgspec
import pytest

from daq.__main__ import acquire
from daq.adapters import adapter_for
from daq.known_device import read_devices
from rigwatch.wire.access import signer_of
from rigwatch.wire.bus import DeviceRequest, accept_device, ask_for_device
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.host import Heartbeat, free_port
from rigwatch.wire.messages import HEALTH, SAMPLES
from rigwatch.wire.rig_config import MonitorSection, SecuritySection
from sim_plant.serve import Device, ModbusServer, RegisterBank
from sim_plant.serve.pty_bridge import PtyBridge
from tests.bus.rig import answers, rigwatch
from tests.daq.rig import config_of
from tests.faults.field import Field, WaveSource
from tests.waiting import eventually

pytestmark = [pytest.mark.xdist_group("faults-modbus"), pytest.mark.long]
RIGHT, OTHER = "RX-2 no. 4711", "RX-2 no. 4712"
PATIENT = "timeout = 2.0\npolls = 8.0\n"
"""The device is a thread of this process, which a busy machine lets answer late."""


def device() -> Device:
    source = WaveSource()
    source.device = Device(source)
    return source.device


class OverTcp:
    """A place on the network where one device or another answers."""

    def __init__(self, folder: Path) -> None:
        self._port = free_port()
        self.section = f'adapter = "modbus-tcp"\nhost = "127.0.0.1"\nport = {self._port}\n{PATIENT}'

    @contextmanager
    def served(self, one: Device, identity: str) -> Iterator[None]:
        """The device answers here, by its identification."""
        server, stop = ModbusServer(one, RegisterBank(3), identity=identity), threading.Event()
        arguments = ("127.0.0.1", self._port, stop)
        thread = threading.Thread(target=server.run_tcp, args=arguments, daemon=True)
        thread.start()
        try:
            eventually(lambda: answers(self._port), f"{identity} listens")
            yield
        finally:
            stop.set()
            thread.join()


class OverRtu:
    """The same on a serial line."""

    def __init__(self, folder: Path) -> None:
        self._link = folder / "line"
        self.section = f'adapter = "modbus-rtu"\nport = "{self._link}"\n{PATIENT}'

    @contextmanager
    def served(self, one: Device, identity: str) -> Iterator[None]:
        server, stop = ModbusServer(one, RegisterBank(3), identity=identity), threading.Event()
        arguments = (PtyBridge(self._link), stop)
        thread = threading.Thread(target=server.run_rtu, args=arguments, daemon=True)
        thread.start()
        try:
            eventually(self._link.exists, f"{identity} is plugged in")
            yield
        finally:
            stop.set()
            thread.join()


Place = OverTcp | OverRtu


def named_in_alarm(rig: Field, identity: str, after_ns: int) -> bool:
    """Whether the alarm `link` has named another device since a moment [ns]."""
    records = [one for one in rig.journalled("link") if one.active]
    causes = [one.alarm.cause for one in records if one.alarm.t_ns >= after_ns]
    return any("another device" in cause and identity in cause for cause in causes)


@contextmanager
def exchanged(rig: Field, served: AbstractContextManager[None]) -> Iterator[None]:
    """Another device answers, and the alarm names it."""
    began = time.time_ns()
    with served:
        eventually(lambda: named_in_alarm(rig, OTHER, began), "the alarm names the other device")
        yield


@pytest.mark.nightly
def test_the_link_alarm_names_the_other_device_and_none_of_its_samples_is_taken(
    tmp_path: Path,
) -> None:
    place, right, other = OverTcp(tmp_path), device(), device()
    with Field(tmp_path, f'{place.section}identity = "4711"') as rig:
        with place.served(right, RIGHT):
            rig.start("daq", "monitor")
            rig.settle(right)
        with exchanged(rig, place.served(other, OTHER)):
            health = rig.health_after("daq", time.time_ns())
            assert health.state == "reconnecting"
            assert OTHER in health.text
        back = time.time_ns()
        with place.served(right, RIGHT):
            rig.event("running", back)
            rig.cleared("link")
            rig.judged(right.boot, right.next_seq)
        assert {block.boot for block in rig.samples} == {right.boot}


@contextmanager
def acquiring(section: str, journal: Path, network: MemoryNetwork) -> Iterator[None]:
    """Data acquisition of a device, in a thread, on a bus in memory."""
    monitor = MonitorSection(model="model.toml", journal=str(journal))
    config = msgspec.structs.replace(config_of(section), monitor=monitor)
    bus, stop = network.bus(config.rig.id, "daq"), threading.Event()
    adapter = adapter_for(config.daq.device, config.channels)
    arguments = (config, adapter, bus, stop, Heartbeat("daq", {}))
    thread = threading.Thread(target=acquire, args=arguments, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@pytest.mark.parametrize("over", [OverTcp, OverRtu])
def test_on_either_line_the_device_that_was_met_first_is_checked(
    over: type[Place], tmp_path: Path
) -> None:
    place, right, other = over(tmp_path), device(), device()
    network = MemoryNetwork()
    ann = network.bus("test", "accept-1", signer_of(SecuritySection(), ""))
    samples, told = ann.subscribe_lossy(SAMPLES), ann.subscribe(HEALTH)
    boots, texts = set[int](), list[str]()

    def heard(boot: int) -> bool:
        boots.update(block.boot for block in samples.drain())
        return boot in boots

    def refused(found: str, expected: str) -> bool:
        texts.extend(health.text for health in told.drain())
        last = texts[-1] if texts else ""
        return "another device" in last and -1 < last.find(found) < last.find(expected)

    with acquiring(place.section, tmp_path / "alarms.jsonl", network):
        with place.served(right, RIGHT):
            eventually(lambda: heard(right.boot), "its samples")
        with place.served(other, OTHER):
            eventually(lambda: refused(OTHER, RIGHT), "the other is refused")
            assert not heard(other.boot)
            asked = DeviceRequest(ask_for_device(ann).answers, "ann", "exchanged")
            assert accept_device(ann, asked).done
            eventually(lambda: heard(other.boot), "its samples, once it is accepted")
        with place.served(right, RIGHT):
            eventually(lambda: refused(RIGHT, OTHER), "the one before is another now")


def test_the_first_device_stays_the_rigs_until_a_person_accepts_another(tmp_path: Path) -> None:
    place, right, other = OverTcp(tmp_path), device(), device()
    with Field(tmp_path, place.section) as rig:
        with place.served(right, RIGHT):
            rig.start("daq", "monitor")
            rig.settle(right)
            assert RIGHT in rig.event("device_learnt").text
            nothing = rigwatch("accept", str(rig.rig.path))
            assert (nothing.returncode, "RX-2 no. 4711" in nothing.stderr) == (1, True)
        with exchanged(rig, place.served(other, OTHER)):
            rig.kill("daq")
            rig.start("daq")
            began = rig.started_ns["daq"]
            eventually(
                lambda: OTHER in rig.health_after("daq", began).text, "refused after a restart too"
            )
            health = rig.health_after("daq", began)
            assert RIGHT in health.text
            assert {block.boot for block in rig.samples} == {right.boot}
            done = rigwatch("accept", str(rig.rig.path), "--user", "ann", "--text", "exchanged")
            assert done.returncode == 0, done.stderr
            accepted = rig.event("device_accepted", began)
            for part in (RIGHT, OTHER, "by ann (not proved), exchanged"):
                assert part in accepted.text
            rig.cleared("link")
            rig.judged(other.boot, other.next_seq)
        met = read_devices(rig.journal.with_name(f"{rig.journal.name}.device"))
        assert [(RIGHT in one.identity, one.user) for one in met] == [(True, ""), (False, "ann")]
        back = time.time_ns()
        with place.served(right, RIGHT):
            eventually(lambda: named_in_alarm(rig, RIGHT, back), "the one before is another now")
