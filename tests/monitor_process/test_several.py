"""Several rigs in one process: each as if alone, and one that fails or is away delays none."""

import contextlib
import threading
from pathlib import Path

import pytest

from monitor.pipeline import RigMonitor
from monitor.process.several import Seat, one_turn, run_several
from rigwatch.commands import main
from rigwatch.wire.bus import Bus
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery import Item, SampleRing
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.messages import ESTIMATES, SAMPLES, EstimateBlock, concatenate
from rigwatch.wire.rig_config import RigConfig, load_rig
from tests.bus.publisher import wave
from tests.bus.rig import TestRig, kill
from tests.monitor_process.model import MODEL, monitor_section
from tests.monitor_process.test_real_process import Judged
from tests.waiting import PATIENCE, eventually, wait_until

pytestmark = pytest.mark.long


class Bench:
    """Rigs on a bus in memory, and one seat for each; the router of r0 answers when it is let."""

    def __init__(self, folder: Path, count: int) -> None:
        self.network, self.said, self.held = MemoryNetwork(), [], threading.Event()
        self.daqs = [self.network.bus(f"r{number}", "daq") for number in range(count)]
        self.rings = [SampleRing(daq, 65536) for daq in self.daqs]
        self.heard = [
            self.network.bus(f"r{number}", "observer").subscribe(ESTIMATES)
            for number in range(count)
        ]
        self.judged: list[list[EstimateBlock]] = [[] for _ in range(count)]
        self.seats = [self.seat(rig_file(folder, f"r{number}")) for number in range(count)]

    def seat(self, path: Path) -> Seat:
        return Seat(path, self.said.append, self.join)

    def join(self, config: RigConfig, process: str) -> Bus:
        if config.rig.id == "r0":
            self.held.wait(PATIENCE)
        return self.network.bus(config.rig.id, process)

    def send(self, number: int, first: int, count: int, size: int = 1) -> None:
        for seq in range(first, first + count, size):
            block = concatenate([wave(seq + at, 1, 1, 0) for at in range(size)])
            self.rings[number].add(block)
            self.daqs[number].publish(SAMPLES, block)

    def last(self, number: int) -> int:
        self.judged[number] += self.heard[number].drain()
        return max((block.seq + len(block) - 1 for block in self.judged[number]), default=-1)

    def join_all(self, numbers: range) -> None:
        """Turn until the monitors of these rigs read: what is sent before is none of theirs."""

        def done() -> bool:
            one_turn(self.seats, contextlib.nullcontext)
            return all(self.seats[n].is_running for n in numbers)

        assert wait_until(done, PATIENCE, 0.001)

    def turn_until(self, numbers: range, seq: int) -> None:
        def done() -> bool:
            one_turn(self.seats, contextlib.nullcontext)
            return all(self.last(number) >= seq for number in numbers)

        assert wait_until(done, PATIENCE, 0.001)


def rig_file(folder: Path, name: str, port: int | None = None) -> Path:
    (folder / name).mkdir()
    rig = TestRig(folder / name, monitor_section(folder / name))
    text = rig.path.read_text().replace('id = "bench"', f'id = "{name}"')
    rig.path.write_text(text if port is None else text.replace(f":{rig.listen}", f":{port}"))
    return rig.path


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path, 3)


def _values(blocks: list[EstimateBlock]) -> dict[int, list[float]]:
    found: dict[int, list[float]] = {}
    for block in blocks:
        for at in range(len(block)):
            assert block.seq + at not in found
            found[block.seq + at] = [column.values[at] for column in block.columns]
    return found


def test_each_rig_is_judged_as_if_alone_and_one_without_a_router_delays_none(bench):
    bench.join_all(range(1, 3))
    for first in range(0, 400, 40):
        bench.send(1, first, 40)
        bench.send(2, first, 40, size=8)
        bench.turn_until(range(1, 3), first + 39)
    alone = RigMonitor(MODEL)
    single = (alone.update(wave(seq, 1, 1, 0)) for seq in range(400))
    expected = _values([watched.estimates for watched in single if watched])
    for number in (1, 2):
        found = _values(bench.judged[number])
        assert len(found) == 400
        assert repr(found) == repr(expected)
    assert bench.last(0) == -1
    bench.held.set()
    bench.join_all(range(1))
    bench.send(0, 0, 40)
    bench.turn_until(range(1), 39)


def test_one_rig_starts_in_a_turn_as_the_others_wait_for_it(bench):
    bench.held.set()
    eventually(lambda: all(seat.has_work(0.0) for seat in bench.seats), "all routers")
    for count in range(3):
        assert sum(seat.is_running for seat in bench.seats) == count
        one_turn(bench.seats, contextlib.nullcontext)
    assert all(seat.is_running for seat in bench.seats)


class Unreadable:
    """A reader whose queue can be neither looked at nor, where a look is due, read."""

    def __init__(self, reader: object) -> None:
        self._reader = reader

    def __getattr__(self, name: str) -> object:
        return getattr(self._reader, name)

    def may_hold(self) -> bool:
        raise OSError("the disk is gone")

    def read(self, _wait_s: float) -> list[Item]:
        raise OSError("the disk is gone")


@pytest.mark.parametrize(("place", "first"), [("take", 40), ("take_judged", 400), ("reader", 40)])
def test_a_rig_that_fails_starts_anew_and_goes_on_where_it_was(bench, monkeypatch, place, first):
    monkeypatch.setattr("monitor.process.several.FIRST_PAUSE", 0.01)
    bench.join_all(range(1, 3))
    for number in (1, 2):
        bench.send(number, 0, first, size=8)
    bench.turn_until(range(1, 3), first - 1)
    broken = bench.seats[1]
    broken._pause = 0.01

    def fail(*_: object) -> None:
        raise OSError("the disk is gone")

    reader = Unreadable(broken._process.reader)
    monkeypatch.setattr(broken._process, place, reader if place == "reader" else fail)
    # By 400 samples the wiring has passed, and both are judged together.
    bench.send(1, first, 40)
    bench.send(2, first, 40)
    bench.turn_until(range(1, 3), first + 39)
    (said,) = bench.said
    assert said.endswith("the disk is gone; starts anew in 0 s")
    assert sorted(_values(bench.judged[1])) == list(range(first + 40))
    assert sum(seat.delivered for seat in bench.seats) >= 2 * (first + 40)


def test_all_rigs_are_read_before_any_is_judged(bench, monkeypatch):
    bench.held.set()
    bench.join_all(range(3))
    for number in range(3):
        bench.send(number, 0, 40)
    left: list[int] = []

    def judge(rig, block):
        left.append(sum(len(seat._process.reader) for seat in bench.seats))
        return judged(rig, block)

    judged = RigMonitor.judge
    monkeypatch.setattr(RigMonitor, "judge", judge)
    one_turn(bench.seats, contextlib.nullcontext)
    assert left == [0, 0, 0]


def test_a_wrong_file_is_named_and_its_rig_joins_once_it_is_right(tmp_path, monkeypatch):
    monkeypatch.setattr("monitor.process.several.LONGEST_PAUSE", 0.01)
    network, said, path = MemoryNetwork(), [], rig_file(tmp_path, "a")
    right = path.read_text()
    path.write_text(right.replace('id = "a"', "id = 7"))
    seat = Seat(path, said.append, lambda config, process: network.bus(config.rig.id, process))

    def turned(holds):
        one_turn([seat], contextlib.nullcontext)
        return holds()

    assert wait_until(lambda: turned(lambda: said), PATIENCE, 0.001)
    assert "rig.id: found 7, expected" in said[0]
    path.write_text(right)
    assert wait_until(lambda: turned(lambda: seat.is_running), PATIENCE, 0.001)
    seat.close()


def test_the_command_leaves_a_wrong_file_to_its_rig(tmp_path, monkeypatch):
    monkeypatch.setattr("monitor.process.run_several", lambda _: 77)
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("rubbish = [")
    assert main(["monitor", str(rig_file(tmp_path, "a")), str(wrong)]) == 77
    assert main(["monitor", str(wrong), str(wrong)]) != 77


def test_two_configurations_of_one_rig_or_one_journal_are_refused(tmp_path):
    path = rig_file(tmp_path, "a")
    twin, other = tmp_path / "twin.toml", tmp_path / "other.toml"
    twin.write_text(path.read_text())
    with pytest.raises(ConfigError, match=r"rig.id: found the same as in .*rig.toml"):
        run_several([path, twin])
    other.write_text(path.read_text().replace('id = "a"', 'id = "b"'))
    with pytest.raises(ConfigError, match=r"monitor.journal: found the same as in .*rig.toml"):
        run_several([path, other])


def test_a_killed_process_of_several_rigs_leaves_no_sample_unjudged(tmp_path):
    with TestRig(tmp_path) as base:
        base.router()
        paths = [rig_file(tmp_path, name, base.listen) for name in ("a", "b")]
        dead = rig_file(tmp_path, "dead")
        judged = [Judged(base.bus("observer", load_rig(path))) for path in paths]
        words = ["-m", "rigwatch", "monitor", *map(str, [*paths, dead])]
        process = base.start(*words)
        for path in paths:
            base.publisher(1, "--wave", path=path)
        for one in judged:
            one.reaches(1, 200)
        kill(process)
        at = [one.last(1) for one in judged]
        base.start(*words)
        for one, last in zip(judged, at, strict=True):
            one.reaches(1, last + 200)
            assert one.missing(1) == []
