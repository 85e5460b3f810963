"""Readers on a real router, while publishers, router and links are killed, frozen and restarted."""

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from rigwatch.wire.bus import ring_questions
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.delivery.sample_reader import Item, SampleReader
from rigwatch.wire.messages.message_types import Event, SampleBlock
from rigwatch.wire.messages.topics import EVENTS, GAPS, SAMPLES
from rigwatch.wire.rig_config import load_rig
from tests.bus.rig import TestRig, kill, stopped
from tests.bus.samples import Ledger, block
from tests.faults.field import least_of
from tests.waiting import eventually

SHORT = 0.05
"""First wait of a reader for a slow ring [s]."""


class Listener:
    """Reads samples in a thread and keeps the ledger."""

    def __init__(self, bus: Bus, **options: object) -> None:
        self.reader = SampleReader(bus, **options)  # type: ignore[arg-type]
        self.ledger = Ledger()
        self.events: list[Event] = []
        self.error: BaseException | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                for item in self.reader.read(0.05):
                    self._take(item)
        except BaseException as error:
            self.error = error

    def _take(self, item: Item) -> None:
        if isinstance(item, Event):
            self.events.append(item)
        else:
            self.ledger.add(item)

    def reaches(self, boot: int, seq: int) -> None:
        eventually(lambda: self.error is not None or self.ledger.last(boot) >= seq, f"seq {seq}")
        assert self.error is None

    def goes_on(self, boot: int, samples: int = 50) -> None:
        """A number of further samples come."""
        self.reaches(boot, self.ledger.last(boot) + samples)

    def misses_for(self, seconds: float) -> None:
        """No sample has come for that long."""
        eventually(lambda: self.reader.silent_for() > seconds, "silence is noticed")

    def codes(self) -> list[str]:
        return [event.code for event in self.events]

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.reader.close()
        assert self.error is None


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[TestRig]:
    with TestRig(tmp_path) as made:
        yield made


class SlowRing(SampleRing):
    """A ring whose answers take several times as long as a reader first waits for them."""

    def _answer(self, question: bytes) -> list[bytes]:
        time.sleep(5 * SHORT)
        return super()._answer(question)


def test_what_a_slow_ring_has_is_not_given_up_by_a_patient_reader(
    rig: TestRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ring_questions, "REPLY_TIMEOUT", SHORT)
    rig.router()
    source = rig.bus("daq")
    ring = SlowRing(source, 4096)
    listener = Listener(rig.bus("reader"), patient=True)
    seq = 0
    while not listener.reader.counters.recovered:
        assert seq < 20_000, "the ring is never heard"
        ring.add(block(seq, 5))
        if seq != 5:
            source.publish(SAMPLES, block(seq, 5))
        seq += 5
        time.sleep(SHORT / 5)
    listener.reaches(7, seq - 1)
    listener.close()
    listener.ledger.assert_complete(7, 0, seq - 1)
    assert listener.ledger.lost(7) == 0
    ring.close()


def test_a_router_that_is_killed_and_comes_back_costs_no_sample(rig: TestRig) -> None:
    router = rig.router()
    listener = Listener(rig.bus("reader"))
    rig.publisher(5)
    listener.reaches(5, 100)
    for _ in range(2):
        kill(router)
        listener.misses_for(0.5)
        router = rig.router()
        listener.goes_on(5)
    listener.close()
    listener.ledger.assert_complete(5)
    assert listener.ledger.lost(5) == 0
    assert listener.reader.counters.recovered > 0


@pytest.mark.parametrize("ring", [65536, 256])
def test_after_a_partition_all_that_the_ring_has_comes_and_the_rest_is_reported(
    rig: TestRig, ring: int
) -> None:
    rig.router()
    proxy, port = rig.proxy()
    far = load_rig(rig.configure("far.toml", port))
    listener = Listener(rig.bus("reader", far))
    gaps = rig.bus("observer").subscribe(GAPS)
    rig.publisher(5, "--ring", str(ring), "--rate", "1000")
    listener.reaches(5, 100)
    before = listener.ledger.last(5)
    with stopped(proxy):
        listener.misses_for(1.0)
        # The link still takes some megabytes; what comes late then is as good as what never left.
        kill(proxy)
    rig.start("-m", "tests.bus.rig", str(port), str(rig.listen))
    listener.reaches(5, before + 1000)
    listener.goes_on(5)
    listener.close()
    listener.ledger.assert_complete(5)
    lost = listener.ledger.lost(5)
    assert lost == listener.reader.counters.lost
    assert (lost == 0) == (ring == 65536)
    published = []

    def all_published() -> bool:
        published.extend(gap.last - gap.first + 1 for gap in gaps.drain())
        return sum(published) == lost

    eventually(all_published, "the gaps are published")


def test_a_frozen_link_delays_samples_and_loses_none(rig: TestRig) -> None:
    rig.router()
    proxy, port = rig.proxy()
    listener = Listener(rig.bus("reader", load_rig(rig.configure("far.toml", port))))
    rig.publisher(5)
    listener.reaches(5, 100)
    with stopped(proxy):
        listener.misses_for(0.5)
    listener.goes_on(5, 200)
    listener.close()
    listener.ledger.assert_complete(5)
    assert listener.ledger.lost(5) == 0


def test_a_partition_longer_than_the_lease_is_noticed_at_once_and_costs_no_sample(
    tmp_path: Path,
) -> None:
    # As 20 s of partition with the default lease of 10 s: the router gives the link up meanwhile.
    with TestRig(tmp_path, lease=1.0) as rig:
        rig.router()
        proxy, port = rig.proxy()
        far = rig.bus("reader", load_rig(rig.configure("far.toml", port)))
        listener, near = Listener(far), Listener(rig.bus("near"))
        rig.publisher(5)
        listener.reaches(5, 100)
        with stopped(proxy):
            listener.misses_for(0.1)
            eventually(lambda: not far.connected(), "the link is given up")
            near.reaches(5, listener.ledger.last(5) + 300)
        eventually(far.connected, "the router is found again")
        listener.goes_on(5, 200)
        for each in (listener, near):
            each.close()
        listener.ledger.assert_complete(5)
        assert listener.ledger.lost(5) == 0
        assert listener.reader.counters.recovered > 256


def test_a_flood_of_connections_disturbs_nobody(rig: TestRig) -> None:
    rig.router()
    listener = Listener(rig.bus("reader"))
    rig.publisher(5)
    listener.reaches(5, 100)
    recovered, late = listener.reader.counters.recovered, list[Listener]()

    def flooded() -> float:
        """From the request of a new client among 500 connections to its first samples [s]."""
        with contextlib.ExitStack() as flood:
            for _ in range(500):
                address = ("127.0.0.1", rig.listen)
                flood.enter_context(socket.create_connection(address, 5.0))
            first, began = listener.ledger.last(5), time.monotonic()
            late.append(Listener(rig.bus("late")))
            late[-1].goes_on(5)
            served = time.monotonic() - began
            listener.reaches(5, first + 200)
        return served

    # 50 samples alone take 0.2 s. Connections are made anew until one flood is survived in time.
    least_of(flooded, 5.0, lambda: None)
    for each in (listener, *late):
        each.close()
        each.ledger.assert_complete(5)
        assert each.ledger.lost(5) == 0
    assert listener.reader.counters.recovered == recovered, "nothing had to be fetched again"
    assert set(listener.codes()) <= {"JOINED"}


def test_a_killed_publisher_is_followed_by_the_head_of_its_successor(rig: TestRig) -> None:
    rig.router()
    listener = Listener(rig.bus("reader"))
    first = rig.publisher(5)
    listener.reaches(5, 100)
    kill(first)
    rig.publisher(6)
    listener.reaches(6, 100)
    listener.close()
    listener.ledger.assert_complete(5)
    listener.ledger.assert_complete(6, 0)
    assert listener.ledger.lost(6) == 0
    assert listener.ledger.unknown_ends == [5]
    assert "SOURCE RESTARTED" in listener.codes()
    assert "DUPLICATE SOURCE" not in listener.codes()


def test_a_reader_knows_whether_it_has_ever_heard_a_sample() -> None:
    network = MemoryNetwork()
    reader = SampleReader(network.bus("bench", "reader"))
    reader.read(0.0)
    assert not reader.heard
    network.bus("bench", "daq").publish(SAMPLES, block(0, 4))
    reader.read(0.5)
    assert reader.heard
    reader.close()


def test_late_joiners_get_the_head_from_the_ring_or_say_where_they_joined(rig: TestRig) -> None:
    rig.router()
    early = Listener(rig.bus("early"))
    rig.publisher(5)
    early.reaches(5, 300)
    with_history = Listener(rig.bus("late"), history=100_000)
    without = Listener(rig.bus("later"))
    with_history.reaches(5, 400)
    without.reaches(5, 400)
    for listener in (early, with_history, without):
        listener.close()
    with_history.ledger.assert_complete(5, 0)
    first = without.ledger.spans[5][0][0]
    without.ledger.assert_complete(5, first)
    assert first > 0
    assert without.events[0].text == f"joined boot 5 at seq {first}"


def test_a_reader_that_resumes_has_everything_since(rig: TestRig) -> None:
    rig.router()
    rig.publisher(5)
    first, other = Listener(rig.bus("first")), Listener(rig.bus("other"))
    first.goes_on(5, 50)
    first.close()
    position = first.reader.position
    assert position is not None
    other.reaches(5, position[1] + 100)
    other.close()
    second = Listener(rig.bus("second"), resume_after=position)
    second.reaches(5, position[1] + 150)
    second.close()
    second.ledger.assert_complete(5, position[1] + 1)
    assert second.ledger.lost(5) == 0


def test_a_reader_that_was_away_for_a_whole_boot_has_it_from_the_ring() -> None:
    network = MemoryNetwork()
    daq = network.bus("r", "daq")
    ring = SampleRing(daq, 1000)
    for boot in (1, 2, 3):
        ring.add(block(0, 50, boot=boot))
    reader = SampleReader(network.bus("r", "reader"), resume_after=(1, 29))
    ring.add(newest := block(50, boot=3))
    daq.publish(SAMPLES, newest)
    ledger = Ledger()

    def complete() -> bool:
        for item in reader.read(0.05):
            ledger.add(item)
        return ledger.last(3) == 50

    eventually(complete, "the newest sample")
    reader.close()
    assert ledger.boots == [2, 3]
    assert ledger.unknown_ends == [1]
    ledger.assert_complete(2, 0, 49)
    ledger.assert_complete(3, 0, 50)
    assert ledger.lost(2) == ledger.lost(3) == 0


def test_of_two_publishers_the_first_is_believed_by_everyone_until_it_dies(rig: TestRig) -> None:
    rig.router()
    listener = Listener(rig.bus("reader"))
    first = rig.publisher(5)
    listener.reaches(5, 20)
    rig.publisher(6)
    eventually(lambda: "DUPLICATE SOURCE" in listener.codes(), "the conflict is remarked on")
    assert listener.reader.contested
    late = Listener(rig.bus("late"))
    late.goes_on(5)
    listener.goes_on(5)
    assert 6 not in late.ledger.spans
    kill(first)
    for one in (listener, late):
        eventually(lambda one=one: one.ledger.delivered(6) > 50, "the second has taken over")  # type: ignore[misc]
        one.close()
        one.ledger.assert_complete(5)
        one.ledger.assert_complete(6)
        assert one.codes().count("DUPLICATE SOURCE") == 1
        assert not one.reader.contested


def test_a_reader_slower_than_its_inbox_leaves_the_rest_to_the_ring() -> None:
    network = MemoryNetwork()
    source, bus = network.bus("bench", "daq"), network.bus("bench", "reader")
    ring, reader = SampleRing(source, 4096), SampleReader(bus, capacity=16)
    ledger = Ledger()
    for seq in range(200):
        ring.add(block(seq))
        source.publish(SAMPLES, block(seq))
    assert reader.dropped > 100

    def complete() -> bool:
        source.publish(SAMPLES, block(199))
        for item in reader.read(0.05):
            ledger.add(item)
        return ledger.last(7) == 199

    eventually(complete, "all samples are there")
    ledger.assert_complete(7, 0, 199)
    assert ledger.lost(7) == 0


def test_garbage_on_the_samples_key_is_counted_and_hurts_nobody() -> None:
    network = MemoryNetwork()
    source, bus = network.bus("bench", "daq"), network.bus("bench", "reader")
    events = network.bus("bench", "observer").subscribe(EVENTS)
    reader = SampleReader(bus)
    for payload in (b"", b"\xff" * 50, b"\x00", bytes(range(256))):
        source.transport.put(source.key(SAMPLES.key), payload)
    source.declare_token("source/not-a-number/x")
    SampleRing(source, 256).add(block(0))
    source.publish(SAMPLES, block(0, 3))
    items = reader.read(1.0)
    assert [item.seq for item in items if isinstance(item, SampleBlock)] == [0]
    assert reader.rejected >= 2
    assert [event.code for event in events.drain()] == ["JOINED"]
