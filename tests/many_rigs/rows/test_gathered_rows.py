"""What rows gather of many rigs: the same blocks, losses and positions as each rig by itself."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rigwatch.recorder.feed import Feed
from rigwatch.recorder.row_feed import RowFeed, Rows
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.messages import (
    ESTIMATES,
    SAMPLES,
    Column,
    ColumnTable,
    EstimateBlock,
    Gap,
    Message,
    SampleBlock,
    cut,
    encode,
)
from rigwatch.wire.session import merge_pending
from tests.many_rigs.rows.memory_links import MemoryLinks
from tests.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.long
COUNT, TURNS, PIECES = 6, 60, 5
CHANNELS = (("voltage", "V"), ("position", "m"), ("acceleration", "m/s^2"))
NAMES = tuple((f"signal{number}", "m/s^2") for number in range(19))


class Site:
    """Daq and monitor of some rigs, and two processes that record them: one with rows."""

    def __init__(self) -> None:
        self.network = MemoryNetwork()
        self.daq, self.monitor = MemoryLinks(self.network), MemoryLinks(self.network)
        self.names = [f"rig{number}" for number in range(COUNT)]
        self.daqs = [self.daq.bus(name, "daq") for name in self.names]
        self.rings = [SampleRing(bus, 65536) for bus in self.daqs]
        self.monitors = [self.monitor.bus(name, "monitor") for name in self.names]
        for bus in self.monitors:
            bus.announce()
        self.links = {kind: MemoryLinks(self.network) for kind in ("alone", "rows")}
        self.rows = Rows(COUNT)
        self.feeds = {kind: [self.feed(kind, row) for row in range(COUNT)] for kind in self.links}
        self.heard: dict[str, list[list[Message]]] = {
            kind: [[] for _ in self.names] for kind in self.links
        }
        self.quick = 0

    def feed(self, kind: str, row: int) -> Feed:
        bus = self.links[kind].bus(self.names[row], "recorder")
        if kind == "alone":
            return Feed(bus, None, {}, catch_up=0.0)
        return RowFeed(self.rows, row, bus, None, {}, catch_up=0.0)

    def send(self, samples: list[SampleBlock], estimates: list[EstimateBlock]) -> None:
        """Send a block of each rig, joined with those of the others."""
        with self.daq.together():
            for bus, ring, one in zip(self.daqs, self.rings, samples, strict=True):
                ring.add(one)
                bus.publish(SAMPLES, one)
        with self.monitor.together():
            for bus, two in zip(self.monitors, estimates, strict=True):
                bus.publish(ESTIMATES, two)

    def take(self) -> None:
        """A turn of both processes."""
        for kind, feeds in self.feeds.items():
            self.links[kind].collect()
            for row, feed in enumerate(feeds):
                self.heard[kind][row] += feed.take()

    def blocks(self, kind: str, row: int, of: type[Message]) -> list[bytes]:
        """All samples or estimates of a rig, whatever the blocks in which they came."""
        heard = [one for one in self.heard[kind][row] if isinstance(one, of)]
        return [encode(one) for one in merge_pending(heard)]

    def gaps(self, kind: str, row: int) -> list[tuple[object, ...]]:
        found = [one for one in self.heard[kind][row] if isinstance(one, Gap)]
        # Those of several topics are told as their rings answer.
        return sorted((one.topic, one.boot, one.first, one.last, one.reason) for one in found)

    def ends(self) -> list[object]:
        """Where each feed is."""
        return [
            (feed._reader.position, feed.positions(), feed.samples, feed.gap_samples)
            for row in range(COUNT)
            for feed in (feeds[row] for feeds in self.feeds.values())
        ]


class Rig:
    """Blocks of one rig."""

    def __init__(self, number: int) -> None:
        self.rng = np.random.default_rng(number)
        self.boot, self.seq, self.names = 1 << 40 | number, 0, NAMES
        self.ahead_ns = 0

    def next(self) -> tuple[SampleBlock, EstimateBlock]:
        n = int(self.rng.choice([1, 8, 9, 9, 10, 31]))
        places = np.arange(self.seq, self.seq + n)
        device_us = (places * 3906.25).astype(np.int64)
        t_ns = 1_700_000_000_000_000_000 + self.ahead_ns + device_us * 1000
        columns = tuple(
            Column(name, unit, self.rng.normal(size=n), np.zeros(n, np.uint8))
            for name, unit in CHANNELS
        )
        samples = SampleBlock("rig", self.boot, self.seq, device_us, t_ns, columns)
        values = ColumnTable(self.names, self.rng.normal(size=(len(self.names), n)))
        estimates = EstimateBlock("rig", self.boot, self.seq, t_ns, values)
        self.seq += n
        return samples, estimates


def undisturbed(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    site.send(*map(list, zip(*sent, strict=True)))  # type: ignore[misc]


@pytest.fixture
def site() -> Site:
    return Site()


def run(site: Site, rigs: list[Rig], turns: int, what: Callable[..., None] = undisturbed) -> None:
    for turn in range(turns):
        for piece in range(PIECES):
            sent = [rig.next() for rig in rigs]
            (what if turn % 7 == 3 and piece in (2, 3) else undisturbed)(site, sent)
        site.take()


def agree(site: Site, rigs: list[Rig]) -> None:
    """Both processes have heard the same of all rigs, to the end."""

    def done() -> bool:
        site.take()
        last, ends = [(rig.boot, rig.seq - 1) for rig in rigs], site.ends()
        heard = all(
            [feed._reader.position for feed in feeds] == last for feeds in site.feeds.values()
        )
        return heard and ends[::2] == ends[1::2]

    assert wait_until(done, PATIENCE, 0.001), site.ends()
    for row in range(COUNT):
        for of in (SampleBlock, EstimateBlock):
            assert site.blocks("rows", row, of) == site.blocks("alone", row, of)
        assert site.gaps("rows", row) == site.gaps("alone", row)


def test_what_simply_follows_is_what_each_rig_hears_and_few_blocks(site: Site) -> None:
    rigs = [Rig(number) for number in range(COUNT)]
    run(site, rigs, TURNS)
    agree(site, rigs)
    for row in range(COUNT):
        assert site.feeds["rows"][row]._reader.joint.rows.is_open(row)
        assert len(site.heard["rows"][row]) < 3 * TURNS
        assert not site.gaps("rows", row)


def flag(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    samples, estimates = sent[1]
    quality = np.zeros(len(samples), np.uint8)
    quality[-1] = 2
    marked = replace(samples.channels[0], quality=quality)
    sent[1] = replace(samples, channels=(marked, *samples.channels[1:])), estimates
    undisturbed(site, sent)


def drop(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    site.network.up = False
    undisturbed(site, sent)
    site.network.up = True


def repeat(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    undisturbed(site, sent)
    with site.daq.together():
        for bus, (samples, _) in zip(site.daqs, sent, strict=True):
            bus.publish(SAMPLES, samples)


def set_clock_back(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    late = [(replace(s, t_ns=s.t_ns - 10**9), replace(e, t_ns=e.t_ns - 10**9)) for s, e in sent]
    undisturbed(site, late)


def forge(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    stranger = MemoryLinks(site.network)
    with stranger.together():
        for name, (samples, estimates) in zip(site.names, sent, strict=True):
            bus = stranger.bus(name, "daq-2")
            bus.publish(SAMPLES, samples)
            stranger.bus(name, "monitor-2").transport.put_among(
                name, ESTIMATES.key, encode(estimates), bytes(16)
            )
    undisturbed(site, sent)


def send_alone(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    """A rig's block comes at its own key, between joined ones."""
    for bus, ring, (samples, _) in zip(site.daqs, site.rings, sent, strict=True):
        ring.add(samples)
        key = f"rig/{bus.rig}/{SAMPLES.key}/alone"
        site.network.deliver(key, encode(samples), bus.identity, b"")
    with site.monitor.together():
        for bus, (_, estimates) in zip(site.monitors, sent, strict=True):
            bus.publish(ESTIMATES, estimates)


def jump(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    """Of a rig the monitor passes samples over."""
    samples, estimates = sent[2]
    sent[2] = samples, replace(estimates, seq=estimates.seq + 100_000)
    undisturbed(site, sent)


def lose_a_number(site: Site, sent: list[tuple[SampleBlock, EstimateBlock]]) -> None:
    """A message without estimates is lost: only the number of the next one tells."""
    site.network.up = False
    with site.monitor.together():
        for bus, (_, estimates) in zip(site.monitors, sent, strict=True):
            bus.publish(ESTIMATES, cut(estimates, 0, 0))
    site.network.up = True
    undisturbed(site, sent)


TROUBLES = (flag, drop, repeat, set_clock_back, forge, send_alone, jump, lose_a_number)


@pytest.mark.parametrize("trouble", TROUBLES, ids=[one.__name__ for one in TROUBLES])
def test_whatever_comes_in_between_all_is_as_without_rows(
    site: Site, trouble: Callable[..., None]
) -> None:
    rigs = [Rig(number) for number in range(COUNT)]
    run(site, rigs, TURNS, trouble)
    run(site, rigs, 3)
    agree(site, rigs)
    for row in range(COUNT):
        assert site.feeds["rows"][row]._reader.joint.rows.is_open(row)


def test_a_source_and_a_monitor_that_begin_anew_are_followed(site: Site) -> None:
    rigs = [Rig(number) for number in range(COUNT)]
    run(site, rigs, 10)
    for row in (1, 4):
        site.rings[row].close()
        site.daqs[row].close()
        site.monitors[row].close()
        site.daqs[row] = site.daq.bus(site.names[row], "daq")
        site.rings[row] = SampleRing(site.daqs[row], 65536)
        site.monitors[row] = site.monitor.bus(site.names[row], "monitor")
        site.monitors[row].announce()
        rigs[row].boot, rigs[row].seq = rigs[row].boot + (1 << 30), 0
        rigs[row].names = NAMES[:7]
    run(site, rigs, 10)
    agree(site, rigs)
    assert site.feeds["rows"][1]._reader.joint.rows.is_open(1)


def test_a_turn_that_comes_late_finds_all_in_its_row_and_a_row_has_room_for_more(
    site: Site,
) -> None:
    rigs = [Rig(number) for number in range(COUNT)]
    run(site, rigs, 5)
    for _ in range(200):  # more samples than a row keeps in one block
        undisturbed(site, [rig.next() for rig in rigs])
        for links in site.links.values():
            links.collect()
    agree(site, rigs)
    for row in range(COUNT):
        assert not site.gaps("rows", row)
        assert len(site.heard["rows"][row]) < 100
