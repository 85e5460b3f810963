"""A structure watched on line: the pure object by itself, and as a process on a real bus."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigwatch.structures.live.live_watch import LiveDamage, LiveSettings, Said
from rigwatch.structures.live.process import PROCESS, StructureProcess
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.records.record import Record
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.errors import ModelError
from rigwatch.wire.messages.message_types import Alarm, Column, EstimateBlock, Event, SampleBlock
from rigwatch.wire.messages.protobuf import encode
from rigwatch.wire.messages.quality_flags import STALE
from rigwatch.wire.messages.topics import ALARMS, ESTIMATES, EVENTS, HEALTH, SAMPLES
from tests.bus.rig import TestRig
from tests.structures.test_damage import K4, KABE, kabe_record
from tests.waiting import eventually

KNOWN = LiveSettings(known=True)


@pytest.fixture(scope="module")
def damaged() -> Record:
    return kabe_record([K4])


def block(record: Record, first: int, last: int, boot: int = 7) -> SampleBlock:
    numbers = np.arange(first, min(last, len(record)))
    columns = tuple(
        Column(name, "m", values[numbers], np.zeros(len(numbers), np.uint8))
        for name, values in record.columns.items()
    )
    return SampleBlock("antenna", boot, first, numbers * 10_000, numbers * 10_000_000, columns)


def cuts(record: Record, size: int) -> Iterator[SampleBlock]:
    return (block(record, first, first + size) for first in range(0, len(record), size))


def watched(blocks: Iterator[SampleBlock], settings: LiveSettings = KNOWN) -> list[Said]:
    live = LiveDamage(load_structure(KABE), 0.01, settings)
    return [message for part in blocks for message in live.update(part)]


def estimates(said: list[Said]) -> np.ndarray:
    parts = [m for m in said if isinstance(m, EstimateBlock)]
    return np.hstack([[m.t_ns, *(c.values for c in m.columns)] for m in parts])


def others(said: list[Said]) -> list[bytes]:
    return [encode(m) for m in said if not isinstance(m, EstimateBlock)]


@pytest.fixture(scope="module")
def said(damaged: Record) -> list[Said]:
    return watched(cuts(damaged, 1), LiveSettings())


def test_k4_is_noticed_within_two_samples_and_named_two_seconds_later(said: list[Said]) -> None:
    alarm = next(m for m in said if isinstance(m, Alarm))
    assert (alarm.name, alarm.severity, alarm.boot) == ("structure_damage", "critical", 7)
    assert alarm.seq <= 502
    assert alarm.t_ns == alarm.seq * 10_000_000
    assert alarm.value > alarm.high
    told = [m for m in said if isinstance(m, Event)]
    assert [m.code for m in told] == ["WATCHED", "DAMAGE"]
    assert told[1].text == "k4_46 softer at 5.000 s"


@pytest.mark.parametrize("size", [7, 250, 2000])
def test_blocks_may_be_cut_anywhere(damaged: Record, said: list[Said], size: int) -> None:
    again = watched(cuts(damaged, size), LiveSettings())
    assert others(again) == others(said)
    assert np.array_equal(estimates(again), estimates(said))


def test_undamaged_noise_alarms_nobody() -> None:
    for seed in range(3):
        quiet = watched(cuts(kabe_record([], 0.05, seed), 50))
        assert [m for m in quiet if isinstance(m, Alarm)] == []
        assert estimates(quiet)[-1].max() < 1.0


@pytest.mark.nightly
def test_lost_and_invalid_samples_are_bridged_and_a_restart_begins_anew(damaged: Record) -> None:
    live, said = LiveDamage(load_structure(KABE), 0.01, KNOWN), list[Said]()
    for part in cuts(damaged, 20):
        if part.seq == 300:
            continue
        if part.seq == 320:
            part.channels[5].values[:] = 99.0
            part.channels[5].quality[:] = STALE
        said += live.update(part)
    (alarm,) = [m for m in said if isinstance(m, Alarm)]
    assert 500 < alarm.seq <= 503
    again = [m for part in cuts(damaged, 20) for m in live.update(_booted(part, 8))]
    assert [m.boot for m in again if isinstance(m, Alarm)] == [8]


def _booted(part: SampleBlock, boot: int) -> SampleBlock:
    return SampleBlock(part.device, boot, part.seq, part.device_us, part.t_ns, part.channels)


def test_what_cannot_be_watched_is_reported(damaged: Record) -> None:
    few = Record(0.01, {name: damaged.columns[name] for name in ("x1", "x2")})
    with pytest.raises(ModelError, match="samples without the channel 'x3'"):
        watched(cuts(few, 100))
    with pytest.raises(ModelError, match="settle: found 0, expected seconds above 0"):
        watched(cuts(damaged, 100), LiveSettings(settle=0.0))
    still = Record(0.01, {n: np.zeros(400) for n in damaged.columns})
    told = [m for m in watched(cuts(still, 100), LiveSettings()) if isinstance(m, Event)]
    assert [m.code for m in told] == ["NOT WATCHED"]


def test_health_says_whether_the_structure_is_watched(damaged: Record) -> None:
    still = Record(0.01, {n: np.zeros(400) for n in damaged.columns})
    for record, before, after, why in (
        (still, "running", "unwatched", "kabe-antenna: found no undamaged sensor"),
        (damaged, "running", "unwatched", "a damage was named"),
        (kabe_record([], 0.05), "running", "running", ""),
    ):
        network = MemoryNetwork()
        live = LiveDamage(load_structure(KABE), 0.01, LiveSettings())
        process = StructureProcess(network.bus("bench", PROCESS), live, 0)
        daq, healths = network.bus("bench", "daq"), network.bus("bench", "eye").subscribe(HEALTH)
        process.turn(0.0)
        for part in cuts(record, 50):
            daq.publish(SAMPLES, part)
            process.turn(0.0)
        process._told = 0.0
        process.turn(0.0)
        told = healths.drain()
        assert [told[0].state, told[-1].state] == [before, after]
        assert told[-1].text.startswith(why)
        process.close()
        live.update(block(record, 0, 10, boot=8))
        assert live.idle == "", "a restart begins anew"


@pytest.mark.nightly
def test_a_process_on_a_real_bus_says_the_same(tmp_path: Path, damaged: Record) -> None:
    expected = watched(cuts(damaged, 10))
    with TestRig(tmp_path) as rig:
        text = rig.path.read_text().replace("[bus]", "sample_rate = 100.0\n\n[bus]")
        rig.path.write_text(text)
        rig.router()
        observer = rig.bus("observer")
        heard = {t: observer.subscribe(t) for t in (ALARMS, EVENTS, ESTIMATES, HEALTH)}
        daq = rig.bus("daq")
        ring = SampleRing(daq, 4096)
        rig.start("-m", "rigwatch", "structure", "watch", str(KABE), str(rig.path), "--known")
        healths = heard[HEALTH]
        eventually(
            lambda: any(h.source == PROCESS for h in healths.drain()), "the structure is watched"
        )
        for part in cuts(damaged, 10):
            ring.add(part)
            daq.publish(SAMPLES, part)
        got: list[Said] = []

        def told() -> bool:
            for topic in (ESTIMATES, ALARMS, EVENTS):
                got.extend(heard[topic].drain())
            return any(isinstance(m, Event) and m.code == "DAMAGE" for m in got)

        eventually(told, "the damage's place")
        got.extend(heard[ESTIMATES].drain())
    own = [m for m in got if not isinstance(m, Event) or m.code in {"WATCHED", "DAMAGE"}]
    assert sorted(others(own)) == sorted(others(expected))
    assert np.array_equal(estimates(got), estimates(expected))
