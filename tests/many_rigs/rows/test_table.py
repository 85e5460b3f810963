"""A table of rigs: the same estimates, alarms, positions and counts as each rig by itself."""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from monitor.alarms.kinds import REPORTED
from monitor.model.model_file import RigModel, model_text
from monitor.process.cursor import stored_position
from monitor.process.several import Seat, one_turn
from monitor.process.table import Table, Tables
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    HEALTH,
    SAMPLES,
    Alarm,
    EstimateBlock,
    Health,
    SampleBlock,
    cut,
)
from rigwatch.wire.messages import quality_flags as quality
from tests.bus.rig import TestRig
from tests.many_rigs.rows.memory_links import MemoryLinks
from tests.monitor.monitor_rig import OTHER_SINE, SINE, block, friction, model, run
from tests.waiting import PATIENCE, eventually, wait_until

# In one worker with the processes of many rigs, which compile the same kernels.
pytestmark = [pytest.mark.long, pytest.mark.xdist_group("many-rigs")]
SECONDS, SIZES = 12.0, (8, 9, 9, 10)


class Side:
    """Daqs, monitors and a listener on a network of their own; the monitors with a table or not."""

    def __init__(self, folder: Path, known: RigModel, count: int, *, table: bool) -> None:
        self.network = MemoryNetwork()
        self.daq, self.links = MemoryLinks(self.network), MemoryLinks(self.network)
        names = [f"r{number}" for number in range(count)]
        self.daqs = [self.daq.bus(name, "daq") for name in names]
        self.rings = [SampleRing(bus, 65536) for bus in self.daqs]
        listeners = [self.network.bus(name, "observer") for name in names]
        self.estimates = [bus.subscribe(ESTIMATES) for bus in listeners]
        self.alarms = [bus.subscribe(ALARMS) for bus in listeners]
        self.heard: list[list[EstimateBlock]] = [[] for _ in names]
        self.said: list[list[Alarm]] = [[] for _ in names]
        self.remarks: list[str] = []
        self.tables = Tables(count) if table else None
        self.paths = [_rig_file(folder / name, name, known) for name in names]
        self.seats = [
            Seat(path, self.remarks.append, lambda config, who: self.links.bus(config.rig.id, who))
            for path in self.paths
        ]
        self.in_table = 0
        eventually(self._all_run, "all rigs")

    def _all_run(self) -> bool:
        self.turn()
        return all(seat.is_running for seat in self.seats)

    def turn(self) -> None:
        one_turn(self.seats, self.links.together, self.links.collect, self.tables)
        self.in_table += sum(seat.is_in_table for seat in self.seats)
        for number in range(len(self.seats)):
            self.heard[number] += self.estimates[number].drain()
            self.said[number] += self.alarms[number].drain()

    def send(self, blocks: list[list[tuple[str, SampleBlock]]]) -> None:
        """Send what there is of each rig in this turn, joined."""
        with self.daq.together():
            for bus, ring, some in zip(self.daqs, self.rings, blocks, strict=True):
                for how, one in some:
                    if how != "again":
                        ring.add(one)
                    if how != "dropped":
                        bus.publish(SAMPLES, one)

    def last(self, number: int) -> tuple[int, int]:
        self.heard[number] += self.estimates[number].drain()
        return max(((b.boot, b.seq + len(b) - 1) for b in self.heard[number]), default=(0, -1))

    def values(self, number: int) -> dict[tuple[int, int], bytes]:
        """All that was told of each sample."""
        found: dict[tuple[int, int], bytes] = {}
        for one in self.heard[number]:
            table = np.array([one.t_ns.view(np.float64), *(c.values for c in one.columns)])
            for at in range(len(one)):
                assert (one.boot, one.seq + at) not in found
                found[one.boot, one.seq + at] = table[:, at].tobytes()
        return found

    def close(self) -> None:
        for seat in self.seats:
            seat.close()


def _rig_file(folder: Path, name: str, known: RigModel) -> Path:
    folder.mkdir(parents=True)
    (folder / "model.toml").write_text(model_text(known))
    journal = folder / "alarms.jsonl"
    section = f'\n[monitor]\nmodel = "{folder / "model.toml"}"\njournal = "{journal}"\n'
    rig = TestRig(folder, section)
    text = rig.path.read_text().replace('id = "bench"', f'id = "{name}"')
    rig.path.write_text(text.replace("[daq.device]", "[daq]\nstale_after = 60.0\n[daq.device]"))
    return rig.path


def _flagged(whole: SampleBlock) -> SampleBlock:
    none = np.zeros(len(whole), np.uint8)
    columns = tuple(replace(one, quality=none.copy()) for one in whole.channels)
    return replace(whole, channels=columns, t_ns=whole.t_ns + time.time_ns())


def healthy_then_friction() -> SampleBlock:
    return _flagged(block(run(SINE, SECONDS, friction(8.0))))


def with_bad_readings() -> SampleBlock:
    channels = run(SINE, SECONDS, seed=2)
    channels["acceleration"][1200:1202] = np.nan
    channels["acceleration"][1500:1700] = np.nan
    whole = _flagged(block(channels))
    whole.device_us[2000:] += 5_000_000
    whole.channels[0].quality[900:903] = quality.SPIKE
    return whole


def undisturbed() -> SampleBlock:
    return _flagged(block(run(SINE, SECONDS, seed=4)))


def that_starts_anew() -> SampleBlock:
    return _flagged(block(run(OTHER_SINE, SECONDS, seed=3)))


def sent(
    whole: SampleBlock, seed: int, trouble: float, again: int
) -> Iterator[list[tuple[str, SampleBlock]]]:
    """What comes of a rig in each turn: blocks, some dropped, late or twice, from a sample on of
    another boot.
    """
    rng, at, kept = np.random.default_rng(seed), 0, None
    while at < len(whole):
        end = min(at + int(rng.choice(SIZES)), len(whole))
        if at < again < end:
            end = again
        part = cut(whole, at, end)
        if at >= again:
            part = replace(part, boot=part.boot + 1, seq=part.seq - again)
        found = [("sent", part)]
        if rng.random() < trouble and again - 100 > end:
            how = rng.choice(["dropped", "twice", "late"])
            found = [("dropped", part)] if how != "twice" else [*found, ("again", part)]
            kept = part if how == "late" else kept
        elif kept is not None:
            found, kept = [*found, ("again", kept)], None
        yield found
        at = end


@pytest.fixture
def sides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Side, Side]]:
    # A rig comes to its table after a look, and samples come faster than in real time here.
    monkeypatch.setattr("monitor.process.several.LOOK_EVERY", 0.002)
    made = [
        Side(tmp_path / name, model(), 4, table=table)
        for name, table in (("alone", False), ("table", True))
    ]
    yield made[0], made[1]
    for side in made:
        side.close()


@pytest.mark.nightly
def test_whatever_happens_to_rigs_of_a_table_they_get_what_they_get_alone(sides) -> None:
    alone, table = sides
    never = 10**9
    rigs = [
        list(sent(healthy_then_friction(), 1, 0.01, never)),
        list(sent(with_bad_readings(), 2, 0.0, never)),
        list(sent(that_starts_anew(), 3, 0.03, 2000)),
        list(sent(undisturbed(), 4, 0.02, never)),
    ]
    turns = max(map(len, rigs))
    for turn in range(turns):
        blocks = [one[turn] if turn < len(one) else [] for one in rigs]
        for side in sides:
            side.send(blocks)
            side.turn()
    ends = [(one[-1][-1][1].boot, _end(one)) for one in rigs]
    for side in sides:

        def done(side: Side = side) -> bool:
            side.turn()
            return all(side.last(number) == end for number, end in enumerate(ends))

        assert wait_until(done, PATIENCE, 0.001), [side.last(number) for number in range(4)]
    assert alone.in_table == 0
    assert table.in_table > 2 * turns  # of four rigs
    for number in range(4):
        assert table.values(number) == alone.values(number)
        assert _of_samples(table.said[number]) == _of_samples(alone.said[number])
        for side in sides:
            content = side.paths[number].with_name("alarms.jsonl.position").read_bytes()
            assert stored_position(content) == ends[number]
    assert _of_samples(table.said[0])
    for seats in zip(alone.seats, table.seats, strict=True):
        for seat in seats:
            seat.leave_table()
        one, other = (seat._process.reader for seat in seats)
        assert one.position == other.position
        assert one.counters.delivered == other.counters.delivered
        assert one.counters.lost == other.counters.lost == 0
    assert not alone.remarks
    assert not table.remarks


def test_a_rig_of_a_table_that_fails_starts_anew_and_no_other_notices(sides, monkeypatch) -> None:
    monkeypatch.setattr("monitor.process.several.FIRST_PAUSE", 0.01)
    _, table = sides
    rigs = [[*sent(undisturbed(), seed, 0.0, 10**9)][:300] for seed in range(4)]
    for number, blocks in enumerate(zip(*rigs, strict=True)):
        if number == 200:
            broken = table.seats[1]
            assert broken.is_in_table
            broken._pause = 0.01
            monkeypatch.setattr(broken._process, "keep_for_ranking", _fail)
        table.send([*blocks])
        table.turn()
    ends = [(1, _end(one)) for one in rigs]

    def done() -> bool:
        table.turn()
        return [table.last(number) for number in range(4)] == ends

    assert wait_until(done, PATIENCE, 0.001)
    for number, (_, last) in enumerate(ends):
        assert sorted(table.values(number)) == [(1, seq) for seq in range(last + 1)]
    (said,) = table.remarks
    assert said.endswith("the disk is gone; starts anew in 0 s")


def test_rigs_stay_in_their_table_while_nothing_is_recorded(sides) -> None:
    _, table = sides
    links = MemoryLinks(table.network)
    recorders = [links.bus(f"r{number}", "recorder") for number in range(4)]
    rigs = [[*sent(undisturbed(), seed, 0.0, 10**9)][:300] for seed in range(4)]
    said = {0: "recording", 100: "not recording", 200: "recording"}
    meanwhile = 0
    for turn, blocks in enumerate(zip(*rigs, strict=False)):
        if turn in said:
            full = float(said[turn] != "recording")
            counters = {"free_share": 0.5, "disk_trouble": full}
            with links.together():
                for bus in recorders:
                    health = Health("recorder", time.time_ns(), said[turn], "", counters)
                    bus.publish(HEALTH, health)
        table.send([*blocks])
        table.turn()
        if 120 <= turn < 200:
            meanwhile += sum(seat.is_in_table for seat in table.seats)
    assert meanwhile > 0.5 * 4 * 80
    for number in range(4):
        found = [one.state for one in table.said[number] if one.name == "recording_stopped"]
        assert found == ["unacknowledged", "cleared_unacknowledged"]
        assert sorted(table.values(number)) == [(1, seq) for seq in range(_end(rigs[number]) + 1)]
    assert not table.remarks


def test_rigs_tell_their_health_from_the_table(sides, monkeypatch) -> None:
    # With each look: on a fast machine all the turns take some hundredths of a second.
    monkeypatch.setattr("monitor.process.health.INTERVAL_NS", 1_000_000)
    _, table = sides
    leaves: list[int] = []
    leave = Table.leave
    monkeypatch.setattr(Table, "leave", lambda of, k: leaves.append(k) or leave(of, k))
    ears = [table.network.bus(f"r{number}", "ear").subscribe(HEALTH) for number in range(4)]
    rigs = [[*sent(undisturbed(), seed, 0.0, 10**9)][:300] for seed in range(4)]
    for number, blocks in enumerate(zip(*rigs, strict=True)):
        if number == 100:
            leaves.clear()
            for ear in ears:
                ear.drain()
        table.send([*blocks])
        table.turn()
    told = [ear.drain() for ear in ears]
    assert min(map(len, told)) > 5
    assert len(leaves) < 0.3 * sum(map(len, told))
    for seat, healths in zip(table.seats, told, strict=True):
        counts = [one.counters["samples"] for one in healths]
        assert counts == sorted(counts)
        assert counts[-1] > counts[0] > 100 * min(SIZES)
        assert {one.state for one in healths} == {"running"}
        assert all(one.counters["latency_ms"] < 1e6 for one in healths)
        seat.leave_table()
        assert counts[-1] <= seat.delivered
    assert not table.remarks


def _fail(*_: object) -> None:
    raise OSError("the disk is gone")


def _end(turns: list[list[tuple[str, SampleBlock]]]) -> int:
    return max(part.seq + len(part) - 1 for _, part in turns[-1])


def _of_samples(said: list[Alarm]) -> list[str]:
    """What the samples have raised: what depends on the clock is left out."""
    return [repr(one) for one in said if one.name not in REPORTED]


def test_a_table_sends_the_bytes_that_each_rig_sends_alone(sides) -> None:
    alone, table = sides
    messages: list[list[list[tuple[bytes, bytes]]]] = []
    for side in sides:
        found: list[list[tuple[bytes, bytes]]] = [[] for _ in side.seats]
        for number in range(4):
            side.network.bus(f"r{number}", "listener").transport.listen_from(
                f"rig/r{number}/monitor/estimates",
                lambda payload, _, mark, into=found[number]: into.append((payload, mark[8:])),
            )
        messages.append(found)
    rigs = [[*sent(undisturbed(), seed, 0.0, 10**9)] for seed in range(4)]
    for turn in zip(*rigs, strict=False):
        for side in sides:
            side.send([*turn])
            side.turn()
    assert table.in_table > 2 * len(rigs[0])
    assert messages[0] == messages[1]
    assert min(map(len, messages[0])) > 300
    for side in sides:  # and the rings have them all
        for number, seat in enumerate(side.seats):
            ring = seat._process.bus.joining(ESTIMATES)[1]
            assert ring.place[1] == len(messages[0][number])
    assert not alone.remarks
