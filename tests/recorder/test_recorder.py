"""The recorder on a real bus: what is said is kept, and a killed recorder leaves no hole."""

import dataclasses
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigwatch.recorder import process
from rigwatch.recorder.folders import choose
from rigwatch.recorder.process import Recorder, describe_run
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.connection import connect
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.zenoh_transport import open_router
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.messages.message_types import (
    Alarm,
    Column,
    EstimateBlock,
    Event,
    Gap,
    Message,
    SampleBlock,
)
from rigwatch.wire.messages.topics import ALARMS, ESTIMATES, EVENTS, GAPS, RECORDERS, SAMPLES
from rigwatch.wire.rig_config import load_rig
from rigwatch.wire.session import open_session, run_info
from tests.waiting import eventually

CONFIG = """
[rig]
id = "bench1"
[bus]
router = "tcp/127.0.0.1:{port}"
listen = "tcp/127.0.0.1:{port}"
[[channels]]
name = "voltage"
unit = "V"
gain = 1.0
[daq.device]
adapter = "serial"
port = "/dev/null"
[recorder]
folder = "{folder}"
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(CONFIG.format(port=free_port(), folder=tmp_path / "sessions"))
    return path


@pytest.fixture(autouse=True)
def disk(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """Share of the disk that is free, whatever this machine's disk has."""
    disk = {"free": 0.5}
    monkeypatch.setattr(process, "free_share", lambda _: disk["free"])
    return disk


def block(seq: int, n: int = 1, boot: int = 7) -> SampleBlock:
    index = np.arange(seq, seq + n)
    column = Column("voltage", "V", index.astype(np.float64), np.zeros(n, np.uint8))
    t_ns = time.time_ns() + index * 3_906_250
    return SampleBlock("rig", boot, seq, index * 3906, t_ns, (column,))


def alarm(seq: int) -> Alarm:
    return Alarm("gap", "normal", "info", "", "", "rig", 7, seq, 5, 0.0, 0.0, 0.0, False, "", seq)


class Source:
    """Stands where the acquisition stands: ring and publisher on the bus."""

    def __init__(self, bus: Bus, kept: int = 65536, boot: int = 7) -> None:
        self.bus, self.ring, self.next, self.boot = bus, SampleRing(bus, kept), 0, boot

    def send(self, count: int) -> None:
        for _ in range(count):
            part = block(self.next, boot=self.boot)
            self.ring.add(part)
            self.bus.publish(SAMPLES, part)
            self.next += 1

    def goes_on(self, samples: int) -> None:
        """So many further samples have been sent."""
        wanted = self.next + samples
        eventually(lambda: self.next >= wanted, f"sample {wanted} is sent")


def recorded(folder: Path) -> list[int]:
    return [n for b in open_session(folder).samples() for n in range(b.seq, b.seq + len(b))]


def test_everything_said_is_kept_once(config: Path) -> None:
    network = MemoryNetwork()
    source = Source(network.bus("bench1", "daq"))
    monitor = network.bus("bench1", "monitor")
    rig = load_rig(config)
    recorder = Recorder(rig, describe_run(config, rig, "a note"), network.bus("bench1", "recorder"))
    source.send(100)
    for seq in range(100):
        column = (Column("theta1", "", np.array([seq * 0.1])),)
        monitor.publish(ESTIMATES, EstimateBlock("rig", 7, seq, np.array([seq]), column))
    monitor.publish(EVENTS, Event("monitor", 5, "info", "HELLO", "here"))
    monitor.publish(GAPS, Gap("rig", 7, 200, 201, 5, "monitor", "not in the ring"))
    monitor.publish(ALARMS, alarm(1))
    recorder.turn(0.0, time.time_ns())
    recorder.close(1.0, time.time_ns())
    last = recorder.store.folder.with_name(".bench1.last")
    assert last.read_text() == recorder.store.folder.name
    session = open_session(recorder.store.folder)
    counts: dict[str, int] = {}
    for item in session.messages():
        counts[item.topic.name] = counts.get(item.topic.name, 0) + 1
    assert recorded(recorder.store.folder) == list(range(100))
    assert counts == {
        "run": 1,
        "samples": 1,
        "estimates": 1,
        "events": 2,  # HELLO, and the reader's own JOINED
        "gaps": 1,
        "alarms": 1,
        "health": 1,
    }
    assert session.info.notes == "a note"
    assert session.info.configuration == config.read_text()
    (estimates,) = session.estimates()
    assert len(estimates) == 100


def test_a_gap_of_alarms_lies_between_those_before_and_after_it(config: Path) -> None:
    network = MemoryNetwork()
    rig = load_rig(config)
    recorder = Recorder(rig, describe_run(config, rig), network.bus("bench1", "recorder"))
    first = network.bus("bench1", "monitor")
    first.publish(ALARMS, alarm(1))
    recorder.turn(0.0, 0)
    first.close()
    second = network.bus("bench1", "monitor")
    second.publish(ALARMS, alarm(2))

    def known() -> bool:
        recorder.turn(1.0, 1)
        found = open_session(recorder.store.folder).messages(["alarms"])
        return len(list(found)) == 2

    eventually(known, "the second run's alarm")
    recorder.close(2.0, 2)
    kept = open_session(recorder.store.folder).messages(["alarms", "gaps"])
    names = [item.topic.name for item in kept if _is_of_alarms(item.message)]
    assert names == ["alarms", "gaps", "alarms"]


def _is_of_alarms(message: Message) -> bool:
    """Whether it is an alarm or a gap of alarms; other topics of the first run have gaps, too."""
    return not isinstance(message, Gap) or message.topic == ALARMS.name


@pytest.mark.parametrize("name", RECORDERS)
def test_a_recorder_speaks_of_its_own_disk_and_keeps_that_once(
    config: Path, disk: dict[str, float], name: str
) -> None:
    network = MemoryNetwork()
    rig = load_rig(config)
    listener = network.bus("bench1", "test").subscribe(EVENTS)
    recorder = Recorder(rig, describe_run(config, rig), network.bus("bench1", name))
    disk["free"] = 0.05
    for turn in range(3):
        recorder.turn(float(turn), turn)
    recorder.close(3.0, 3)
    said = [event for event in listener.drain() if event.code == "DISK_NEARLY_FULL"]
    assert [event.source for event in said] == [name]
    kept = [item.message for item in open_session(recorder.store.folder).messages(["events"])]
    assert [event.source for event in kept if event.code == "DISK_NEARLY_FULL"] == [name]


def test_a_recorder_whose_disk_is_away_says_so_and_keeps_the_samples(config: Path) -> None:
    rig = load_rig(config)
    assert rig.recorder is not None
    root = Path(rig.recorder.folder)
    root.write_text("in the way")
    network = MemoryNetwork()
    source = Source(network.bus("bench1", "daq"))
    listener = network.bus("bench1", "test").subscribe(EVENTS)
    recorder = Recorder(rig, describe_run(config, rig), network.bus("bench1", "recorder"))
    for turn in range(4):
        source.send(50)
        recorder.turn(float(turn), turn)
    root.unlink()
    recorder.turn(5.0, 5)
    recorder.close(6.0, 6)
    expected = ["JOINED", "RECORDING_STOPPED", "RECORDING_RESUMED"]
    assert [event.code for event in listener.drain()] == expected
    assert recorded(recorder.store.folder) == list(range(200))
    kept = [item.message for item in open_session(recorder.store.folder).messages(["events"])]
    assert [event.code for event in kept if isinstance(event, Event)] == expected


def test_a_session_goes_on_after_a_short_break_only(tmp_path: Path, config: Path) -> None:
    network = MemoryNetwork()
    source = Source(network.bus("bench1", "daq"))
    rig = load_rig(config)
    run = describe_run(config, rig)
    recorder = Recorder(rig, run, network.bus("bench1", "recorder"))
    source.send(30)
    recorder.turn(0.0, time.time_ns())
    recorder.close(0.0, time.time_ns())
    folder = recorder.store.folder
    again = choose(tmp_path / "sessions", run)
    assert (again.folder, again.last) == (folder, (7, 29))
    later = run_info("bench1", 256.0, t_ns=run.t_ns + 10**12, configuration_sha256="")
    assert choose(tmp_path / "sessions", later).folder != folder
    other = run_info("bench1", 256.0, t_ns=run.t_ns, configuration_sha256="changed")
    assert choose(tmp_path / "sessions", other).folder != folder
    assert choose(tmp_path / "nowhere", run).last is None


@pytest.mark.parametrize("restarted", [False, True])
def test_a_recorder_started_anew_with_a_changed_configuration_misses_nothing(
    config: Path, *, restarted: bool
) -> None:
    network = MemoryNetwork()
    daq, monitor = network.bus("bench1", "daq"), network.bus("bench1", "monitor")
    source, rig = Source(daq), load_rig(config)
    run = describe_run(config, rig)
    before = Recorder(rig, run, network.bus("bench1", "recorder"))
    source.send(30)
    monitor.publish(ALARMS, alarm(0))
    before.turn(0.0, time.time_ns())
    before.close(0.0, time.time_ns())
    if restarted:
        source.ring.close()
        source = Source(daq, boot=8)
    source.send(10)
    monitor.publish(ALARMS, alarm(1))
    changed = dataclasses.replace(run, configuration_sha256="changed")
    recorder = Recorder(rig, changed, network.bus("bench1", "recorder"))
    assert recorder.store.folder != before.store.folder
    source.send(5)
    alarms = recorder.feed._numbered["alarms"]

    def complete() -> bool:
        recorder.turn(0.0, time.time_ns())
        samples = recorder.feed.samples >= (5 if restarted else 15)
        return samples and alarms.positions().get("monitor", (0, 0))[1] == 1

    eventually(complete, "what was sent meanwhile is recorded")
    recorder.close(1.0, time.time_ns())
    # What another start of the device sent belongs to no recording.
    assert recorded(recorder.store.folder) == list(range(10, 15) if restarted else range(30, 45))
    session = open_session(recorder.store.folder)
    assert [item.message for item in session.messages(["gaps"])] == []
    kept = [item.message for item in session.messages(["alarms"])]
    assert [message.seq for message in kept if isinstance(message, Alarm)] == [1]


def test_after_a_kill_and_a_long_break_a_new_session_has_what_the_ring_kept_and_a_gap(
    tmp_path: Path, config: Path
) -> None:
    network = MemoryNetwork()
    source = Source(network.bus("bench1", "daq"), kept=100)
    rig = load_rig(config)
    run = describe_run(config, rig)
    killed = Recorder(rig, run, network.bus("bench1", "recorder"))
    source.send(30)
    killed.turn(0.0, time.time_ns())
    killed.feed.close()
    source.send(170)
    later = dataclasses.replace(run, t_ns=run.t_ns + 10**12)
    recorder = Recorder(rig, later, network.bus("bench1", "recorder"))
    assert recorder.store.folder != killed.store.folder
    source.send(5)

    def complete() -> bool:
        recorder.turn(0.0, time.time_ns())
        return recorder.feed.samples >= 100

    eventually(complete, "what the ring kept is recorded")
    recorder.close(1.0, time.time_ns())
    assert recorded(recorder.store.folder) == list(range(105, 205))
    told = [item.message for item in open_session(recorder.store.folder).messages(["gaps"])]
    assert [(gap.first, gap.last) for gap in told if isinstance(gap, Gap)] == [(30, 104)]


def test_a_recorder_started_again_keeps_what_was_said_meanwhile(config: Path) -> None:
    network = MemoryNetwork()
    source = Source(network.bus("bench1", "daq"))
    monitor = network.bus("bench1", "monitor")
    rig = load_rig(config)

    def record(seqs: range) -> Path:
        recorder = Recorder(rig, describe_run(config, rig), network.bus("bench1", "recorder"))
        for seq in seqs:
            monitor.publish(ALARMS, alarm(seq))
        source.send(5)

        def done() -> bool:
            recorder.turn(0.0, time.time_ns())
            return recorder.feed.positions()["alarms"]["monitor"][1] + 1 >= seqs.stop

        eventually(done, "all alarms are taken")
        recorder.feed.close()
        return recorder.store.folder

    record(range(3))
    for seq in range(3, 7):
        monitor.publish(ALARMS, alarm(seq))
    folder = record(range(7, 9))
    said = [item.message for item in open_session(folder).messages(["alarms"])]
    assert [message.seq for message in said if isinstance(message, Alarm)] == list(range(9))


@pytest.mark.parametrize("torn", [False, True])
@pytest.mark.parametrize("pause_s", [0, 1000])
def test_one_killed_before_it_had_samples_leaves_no_hole_in_the_alarms(
    config: Path, pause_s: int, *, torn: bool
) -> None:
    network = MemoryNetwork()
    monitor = network.bus("bench1", "monitor")
    rig = load_rig(config)
    run = describe_run(config, rig)

    def recorder(t_ns: int) -> Recorder:
        return Recorder(rig, dataclasses.replace(run, t_ns=t_ns), network.bus("bench1", "recorder"))

    def records(one: Recorder, count: int) -> None:
        def done() -> bool:
            one.turn(0.0, time.time_ns())
            return one.feed.positions()["alarms"].get("monitor", (0, -1))[1] + 1 >= count

        eventually(done, f"{count} alarms are taken")

    first = recorder(run.t_ns)
    monitor.publish(ALARMS, alarm(0))
    records(first, 1)
    first.feed.close()
    if torn:  # the next one was killed, too, as it began a file
        place = first.store.folder.with_name("bench1-20991231T000000Z")
        place.mkdir()
        (place / "000001.mcap").touch()
    for seq in range(1, 4):
        monitor.publish(ALARMS, alarm(seq))
    second = recorder(time.time_ns() + pause_s * 10**9)
    monitor.publish(ALARMS, alarm(4))
    records(second, 5)
    second.close(1.0, time.time_ns())
    folders = dict.fromkeys([first.store.folder, second.store.folder])
    assert len(folders) == (2 if pause_s else 1)
    kept = [item.message for one in folders for item in open_session(one).messages(["alarms"])]
    assert [message.seq for message in kept if isinstance(message, Alarm)] == list(range(5))


@pytest.fixture
def router(config: Path) -> Iterator[None]:
    close = open_router(load_rig(config).bus.listen)
    yield
    close()


def start(config: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "rigwatch", "record", str(config), "--json"]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def writes_files(recorder: subprocess.Popen[str], root: Path, count: int) -> None:
    """The recorder runs until so many files are there."""
    eventually(
        lambda: recorder.poll() is not None or len(list(root.glob("*/*.mcap"))) >= count,
        f"{count} files",
    )
    assert recorder.poll() is None


@pytest.mark.usefixtures("router")
def test_killed_and_started_again_over_zenoh(tmp_path: Path, config: Path) -> None:
    """`rigwatch record` under kill -9 in mid-run: no sample is missing from its first on."""
    bus = connect(load_rig(config), "daq", timeout=10.0)
    source = Source(bus)
    stop = threading.Event()

    def publish() -> None:
        while not stop.wait(0.02):
            source.send(5)

    thread = threading.Thread(target=publish)
    thread.start()
    first = start(config)
    try:
        writes_files(first, tmp_path / "sessions", 1)
        source.goes_on(200)
        os.kill(first.pid, signal.SIGKILL)
        first.wait()
        second = start(config)
        try:
            writes_files(second, tmp_path / "sessions", 2)
            source.goes_on(200)
        finally:
            second.send_signal(signal.SIGTERM)
            output, _ = second.communicate(timeout=20)
    finally:
        stop.set()
        thread.join()
        bus.close()
    assert second.returncode == 0
    folder = Path(json.loads(output)["session"])
    assert list((tmp_path / "sessions").glob("bench1-*")) == [folder]
    seqs = recorded(folder)
    assert seqs == list(range(seqs[0], seqs[-1] + 1))
    assert len(seqs) > 300
    session = open_session(folder)
    assert [item.message for item in session.messages(["gaps"])] == []
    assert len(session.unclosed) == 1
