"""What waits in Zenoh's channel for a process of several rigs: each message once and in order."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from rigwatch.wire.bus import Bus, SharedLinks, connect
from rigwatch.wire.bus.several import WAITING
from rigwatch.wire.delivery import SampleReader, SampleRing
from rigwatch.wire.messages import ALARMS, SAMPLES, SampleBlock
from tests.bus.rig import TestRig, kill
from tests.bus.samples import block
from tests.bus.test_complete_subscription import alarm
from tests.waiting import PATIENCE, eventually

EARLIER = 99


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[TestRig]:
    with TestRig(tmp_path) as made:
        made.router()
        yield made


@pytest.fixture
def links() -> Iterator[SharedLinks]:
    made = SharedLinks(2)
    yield made
    made.close()


def samples(items: list[object], boot: int) -> list[int]:
    blocks = [item for item in items if isinstance(item, SampleBlock) and item.boot == boot]
    return [seq for one in blocks for seq in range(one.seq, one.seq + len(one))]


def test_what_a_killed_source_sent_last_is_read_before_its_end(
    rig: TestRig, links: SharedLinks
) -> None:
    other = connect(rig.config, "other", PATIENCE, links)
    at_once, later = SampleReader(rig.bus("one")), SampleReader(other)
    heard: list[object] = []
    found: list[object] = []

    def reads(reader: SampleReader, items: list[object], boot: int, until: int) -> bool:
        items.extend(reader.read(0.05))
        return until in samples(items, boot)

    process = rig.publisher(5)
    eventually(lambda: reads(later, found, 5, 5), "first samples")
    first = samples(found, 5)[-1]
    eventually(lambda: reads(at_once, heard, 5, first + 80), "samples, which wait for the other")
    kill(process)
    rig.publisher(6)
    eventually(lambda: reads(at_once, heard, 6, 5), "samples of the next")
    eventually(lambda: reads(later, found, 6, 5), "the same")
    # Each sample is sent twice, for processes of one rig first: a kill may come between the two.
    assert samples(heard, 5)[-1] - samples(found, 5)[-1] in (0, 1)
    assert samples(found, 5) == list(range(samples(found, 5)[0], samples(found, 5)[-1] + 1))
    assert later.counters.foreign == 0
    other.close()


def test_what_a_process_said_before_its_end_is_not_taken_for_lost(
    rig: TestRig, links: SharedLinks
) -> None:
    other = connect(rig.config, "other", PATIENCE, links)
    alarms, outside = other.listen(ALARMS), rig.bus("outside")

    said: list[int] = []

    def hears(seq: int) -> bool:
        heard = [message.seq for message in alarms.catch_up(0.05)]
        said.extend(each for each in heard if each < EARLIER)
        return seq in heard

    def reaches(source: Bus, seq: int) -> bool:
        source.publish(ALARMS, alarm(seq))
        return hears(seq)

    eventually(lambda: reaches(outside, EARLIER), "that the router knows of the listener")
    for run in range(3):
        monitor = connect(rig.config, "monitor", PATIENCE)
        eventually(lambda: "alive/monitor" in outside.tokens("alive/*"), "its token")
        known = partial(reaches, monitor, EARLIER + 1 + run)
        eventually(known, "that it knows of the listener")
        for seq in range(3):
            monitor.publish(ALARMS, alarm(10 * run + seq))
        monitor.close()
        eventually(lambda: "alive/monitor" not in outside.tokens("alive/*"), "its end")
    eventually(lambda: hears(22), "all")
    assert said == [0, 1, 2, 10, 11, 12, 20, 21, 22]
    assert alarms.lost == alarms.foreign == 0
    other.close()


def test_more_than_may_wait_is_fetched_from_the_rings_and_counted(
    rig: TestRig, links: SharedLinks
) -> None:
    daq, other = rig.bus("daq"), connect(rig.config, "other", PATIENCE, links)
    ring, reader, alarms = SampleRing(daq, 65536), SampleReader(other), other.listen(ALARMS)
    found: list[object] = []
    said: list[int] = []

    def send(seqs: range) -> None:
        for seq in seqs:
            ring.add(block(seq))
            daq.publish(SAMPLES, block(seq))
            daq.publish(ALARMS, alarm(seq))

    def complete(until: int) -> bool:
        found.extend(reader.read(0.05))
        said.extend(message.seq for message in alarms.catch_up(0.05))
        return until in samples(found, 7) and until in said

    send(range(2))
    eventually(lambda: complete(1), "the first")
    send(range(2, 3 * WAITING))
    eventually(lambda: len(reader) == WAITING, "a full channel")
    eventually(lambda: complete(3 * WAITING - 1), "all")
    assert samples(found, 7) == said == list(range(3 * WAITING))
    assert reader.counters.recovered > 0
    assert reader.counters.lost == alarms.lost == 0
    assert alarms.get(timeout=0.01) is None
    other.close()
