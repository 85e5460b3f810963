"""What a stranger sends in a boot's name: dropped, counted, told, while the real samples come."""

import time
from collections.abc import Callable

import pytest

from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery import sample_reader
from rigwatch.wire.delivery.ring import SOURCE_KEY, SampleRing
from rigwatch.wire.delivery.sample_reader import SampleReader
from rigwatch.wire.messages import SAMPLES, Event, SampleBlock
from rigwatch.wire.ordering.outcomes import FORGED, POSITION_WRONG, Loss
from rigwatch.wire.ordering.ownership import MOST_UNPROVED, Owners
from rigwatch.wire.ordering.sample_order import SUSPECT, SampleOrder
from tests.bus.samples import block, is_intact
from tests.bus.test_sample_order import Bench
from tests.waiting import wait_until

BILLION = 10**9


def test_a_jump_that_the_ring_has_not_seen_is_dropped_and_nothing_is_lost() -> None:
    bench = Bench()
    bench.send(block(0, 10))
    bench.take(bench.order.on_block(block(BILLION, 1)))
    for seq in range(10, 50, 10):
        bench.send(block(seq, 10))
        bench.reply_all()
    assert bench.order.position == (7, 49)
    assert bench.order.counters.lost == 0
    assert bench.order.counters.foreign >= 1
    assert FORGED in [remark.code for remark in bench.remarks]


@pytest.mark.parametrize("seq", [-5, 2**53, 2**63 - 1])
def test_numbers_that_no_device_reaches_are_dropped(seq: int) -> None:
    bench = Bench()
    bench.send(block(0, 10))
    forged = SampleBlock("rig", 7, seq, *_columns(block(0, 1)))
    bench.take(bench.order.on_block(forged))
    bench.send(block(10, 10))
    assert bench.order.position == (7, 19)
    assert not bench.asks


def _columns(part: SampleBlock) -> tuple[object, ...]:
    return part.device_us, part.t_ns, part.channels


def test_a_poisoned_position_is_set_back_to_the_newest_of_the_ring() -> None:
    bench = Bench(SampleOrder(resume_after=(7, BILLION), history=100))
    bench.order.on_token(7, 1, True)
    sent = 0
    while sent <= 2 * SUSPECT:
        bench.send(block(sent, 16))
        bench.reply_all()
        sent += 16
    assert POSITION_WRONG in [remark.code for remark in bench.remarks]
    assert bench.order.position == (7, sent - 1)


def test_the_first_token_owns_a_boot_until_it_is_gone() -> None:
    owners = Owners()
    owners.appeared(7, 100, "daq")
    assert owners.admits(7, "daq")
    assert not owners.admits(7, "eve")
    owners.appeared(7, 50, "eve")
    assert owners.admits(7, "daq")
    assert not owners.admits(7, "eve")
    owners.appeared(7, 200, "daq again")
    owners.vanished(7, 50)
    assert not owners.admits(7, "daq again")
    owners.vanished(7, 100)
    assert owners.admits(7, "daq again")
    assert not owners.admits(7, "daq")


def test_a_boot_whose_owner_is_gone_is_no_strangers() -> None:
    owners = Owners()
    owners.appeared(7, 100, "daq")
    owners.vanished(7, 100)
    assert not owners.admits(7, "eve")
    assert owners.admits(7, "daq"), "its last samples were overtaken by its end"
    for boot in range(1000, 1000 + 2 * MOST_UNPROVED):
        owners.admits(boot, "eve")
    assert not owners.admits(7, "eve")
    owners.appeared(7, 200, "daq again")
    assert owners.admits(7, "daq again")
    assert not owners.admits(7, "daq")


def test_samples_after_the_end_of_their_source_are_its_own_and_no_conflict_with_its_next() -> None:
    network = MemoryNetwork()
    daq, eve, again = (network.bus("bench", name) for name in ("daq", "eve", "again"))
    ring = SampleRing(daq, 4096)
    reader = SampleReader(network.bus("bench", "reader"))

    def send(part: SampleBlock) -> None:
        ring.add(part)
        daq.publish(SAMPLES, part)

    send(block(0, 4))
    ring.close()
    forged = block(4, 4)
    forged.channels[0].values[:] = -1.0
    eve.publish(SAMPLES, forged)
    daq.publish(SAMPLES, block(4, 4))
    again.publish(SAMPLES, block(8, 4))  # before its token
    items = reader.read(0.0)
    assert reader.position == (7, 7)
    assert reader.counters.foreign == 8
    SampleRing(again, 4096).add(block(8, 4))
    again.publish(SAMPLES, block(8, 4))
    items += reader.read(0.0)
    assert reader.position == (7, 11)
    assert all(is_intact(item) for item in items if isinstance(item, SampleBlock))
    assert [item.code for item in items if isinstance(item, Event)] == [
        "JOINED",
        "DUPLICATE SOURCE",
    ]
    reader.close()


def test_one_who_spoke_before_the_token_came_does_not_keep_the_boot() -> None:
    owners = Owners()
    assert owners.admits(7, "eve")
    owners.appeared(7, 100, "daq")
    assert owners.admits(7, "daq")
    assert not owners.admits(7, "eve")


def test_samples_in_the_name_of_a_boot_are_dropped_counted_and_contested() -> None:
    network = MemoryNetwork()
    daq, eve = network.bus("bench", "daq"), network.bus("bench", "eve")
    ring = SampleRing(daq, 4096)
    reader = SampleReader(network.bus("bench", "reader"))
    items: list[object] = []

    def send(part: SampleBlock) -> None:
        ring.add(part)
        daq.publish(SAMPLES, part)

    send(block(0, 4))
    for seq in range(4, 400, 4):
        # Her samples come first, and one of them is far ahead.
        forged = block(seq, 4)
        forged.channels[0].values[:] = -1.0
        eve.publish(SAMPLES, forged)
        eve.publish(SAMPLES, block(BILLION + seq, 1))
        send(block(seq, 4))
    assert wait_until(_reads(reader, items, 399), 10.0, 0.001)
    values = [v for b in items if isinstance(b, SampleBlock) for v in b.channels[0].values]
    assert len(values) == 400
    assert min(values) >= 0.0
    assert reader.counters.foreign == 99 * 5
    assert reader.counters.lost == 0
    assert reader.contested
    events = [item.code for item in items if isinstance(item, Event)]
    assert events.count("DUPLICATE SOURCE") == 1
    reader.close()


def _reads(reader: SampleReader, items: list[object], last: int) -> Callable[[], bool]:
    def done() -> bool:
        items.extend(reader.read(0.0))
        return reader.position == (7, last)

    return done


def test_a_loss_by_a_wrong_position_is_of_unknown_length() -> None:
    bench = Bench(SampleOrder(resume_after=(7, BILLION)))
    losses: list[Loss] = []
    for seq in range(0, 2 * SUSPECT, 16):
        bench.send(block(seq, 16))
        while bench.asks:
            ask = bench.asks.popleft()
            found = bench.order.on_reply(ask, bench.stores[7].reply(ask))
            losses += [one for one in found if isinstance(one, Loss)]
            bench.take([one for one in found if not isinstance(one, Loss)])
    assert [loss.last - loss.first for loss in losses] == [-1]


@pytest.fixture
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A source that came first and is silent is passed over soon."""
    monkeypatch.setattr(sample_reader, "BEYOND_LEASE", 0.2)


class Strangers:
    """A rig's daq, a stranger with a token of an early start, and a reader that begins later."""

    def __init__(self, boot: int, lease: float = 10.0) -> None:
        network = MemoryNetwork(lease)
        self.daq, self.eve = network.bus("bench", "daq"), network.bus("bench", "eve")
        self.token = self.eve.named_token(SOURCE_KEY)
        self.token.declare(f"{boot}/1")
        self.ring, self.sent = SampleRing(self.daq, 65536), 0
        self.send()
        self.reader = SampleReader(network.bus("bench", "reader"))
        self.items: list[object] = []

    def send(self) -> None:
        """Four samples of the device."""
        part = block(self.sent, 4)
        self.ring.add(part)
        self.daq.publish(SAMPLES, part)
        self.sent += 4

    def reads(self) -> bool:
        """Whether the newest of the device's samples are read."""
        self.send()
        self.items.extend(self.reader.read(0.01))
        return self.reader.position == (7, self.sent - 1)

    def codes(self) -> list[str]:
        return [item.code for item in self.items if isinstance(item, Event)]


@pytest.mark.parametrize("boot", [7, 9])
@pytest.mark.usefixtures("soon")
def test_a_stranger_who_says_that_he_came_first_and_is_silent_keeps_no_reader_away(
    boot: int,
) -> None:
    bench = Strangers(boot, lease=0.1)
    assert wait_until(bench.reads, 10.0, 0.01)
    assert bench.codes().count("DUPLICATE SOURCE") == 1
    assert bench.reader.contested
    bench.eve.publish(SAMPLES, block(BILLION, 4, boot=boot))
    assert wait_until(bench.reads, 10.0, 0.01)
    assert bench.reader.counters.lost == 0
    assert all(is_intact(item) for item in bench.items if isinstance(item, SampleBlock))
    bench.token.close()
    time.sleep(sample_reader.CONTESTED + 0.1)
    bench.reads()
    assert not bench.reader.contested
    bench.reader.close()


@pytest.mark.parametrize("boot", [7, 9])
def test_one_that_came_first_is_waited_for_as_long_as_its_token_may_outlive_it(boot: int) -> None:
    bench = Strangers(boot)
    assert not wait_until(bench.reads, 2.0, 0.05)
    assert bench.reader.silent_for() > 1.5, "what is not read is not heard"
    bench.token.close()
    assert wait_until(bench.reads, 10.0, 0.01)
    assert bench.codes() == ["JOINED"]
    assert not bench.reader.contested
    bench.reader.close()


@pytest.mark.parametrize("boot", [7, 9])
@pytest.mark.usefixtures("soon")
def test_the_wait_is_longer_than_the_lease_whatever_that_is(boot: int) -> None:
    bench = Strangers(boot, lease=2.0)
    assert not wait_until(bench.reads, 1.5, 0.05)
    assert wait_until(bench.reads, 10.0, 0.01)
    bench.reader.close()


@pytest.mark.usefixtures("soon")
def test_an_owner_that_was_heard_is_never_passed_over() -> None:
    bench = Strangers(9, lease=0.1)
    bench.token.close()
    assert wait_until(bench.reads, 10.0, 0.01)
    bench.token.declare("7/1")
    forged = block(bench.sent, 4)
    forged.channels[0].values[:] = -1.0
    deadline = time.monotonic() + 1.0
    while time.monotonic() < deadline:
        bench.eve.publish(SAMPLES, forged)
        bench.items.extend(bench.reader.read(0.02))
    assert wait_until(bench.reads, 10.0, 0.01)
    assert "DUPLICATE SOURCE" in bench.codes()
    assert all(is_intact(item) for item in bench.items if isinstance(item, SampleBlock))
    bench.reader.close()


def test_a_token_that_returns_with_the_router_is_its_owner_s_before_a_stranger_s() -> None:
    owners = Owners()
    owners.appeared(7, 100, "daq")
    assert owners.admits(7, "daq")
    owners.vanished(7, 100)
    owners.appeared(7, 1, "eve")
    assert not owners.admits(7, "daq")
    owners.appeared(7, 100, "daq")
    assert owners.admits(7, "daq")
    assert not owners.admits(7, "eve")
