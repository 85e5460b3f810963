"""What a reader remembers of sources stays the same however many there have been."""

import pickle
import tracemalloc
from functools import partial

import pytest

from rigwatch.wire.bus import complete_subscription
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.messages import ALARMS, SampleBlock, decode, encode
from rigwatch.wire.ordering import Owners, SampleOrder
from tests.bus.samples import block
from tests.bus.test_complete_subscription import alarm
from tests.bus.test_sample_order import Bench
from tests.waiting import PATIENCE, wait_until

FEW, MANY = 200, 600


def kept(what: object) -> int:
    """Size of all that an object holds [bytes]."""
    return len(pickle.dumps(what))


def restarted(bench: Bench, boots: range) -> None:
    """The device starts anew for each boot, which has a token."""
    for boot in boots:
        bench.take(bench.order.on_token(boot, boot, True))
        bench.send(block(0, 4, boot=boot))
        bench.reply_all()
        bench.take(bench.order.on_token(boot, boot, False))


def test_a_device_that_starts_anew_every_day_fills_no_memory() -> None:
    bench = Bench()
    restarted(bench, range(1000, 1000 + FEW))
    before = kept(bench.order)
    restarted(bench, range(1000 + FEW, 1000 + MANY))
    assert bench.order.position == (999 + MANY, 3)
    assert bench.order.counters.lost == 0
    assert kept(bench.order) - before < 100


def test_boots_that_a_stranger_makes_up_fill_no_memory_and_hide_no_new_source() -> None:
    order: SampleOrder = SampleOrder()
    owners = Owners()
    order.on_token(7, 1, True)
    order.on_block(block(0, 4, boot=7))
    sizes = {}
    for boot in range(1000, 1000 + MANY):
        owners.admits(boot, "stranger")
        order.on_block(block(0, 4, boot=boot))
        sizes[boot - 999] = kept(order) + kept(owners)
    assert sizes[MANY] - sizes[FEW] < 100
    order.on_token(8, 2, True)
    order.on_block(block(0, 4, boot=8))
    order.on_token(7, 1, False)
    assert order.sources.current == 8


def test_a_process_that_starts_anew_every_day_fills_no_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(complete_subscription, "RUN_KEPT", 0.0)
    network = MemoryNetwork()
    listener = network.bus("r", "listener").listen(ALARMS)
    heard: list[int] = []

    def comes(day: int) -> bool:
        heard.extend(alarm.seq for alarm in listener.drain())
        return day in heard

    for day in range(3):
        monitor = network.bus("r", "monitor")
        monitor.publish(ALARMS, alarm(day))
        assert wait_until(partial(comes, day), PATIENCE, 0.01)
        monitor.close()
    listener.drain()
    assert heard == [0, 1, 2]
    assert len(listener._runs) == 0


def test_encoding_the_blocks_of_hundreds_of_boots_fills_no_memory() -> None:
    def encoded(boots: range) -> bytes:
        return [encode(block(0, 4, boot=boot)) for boot in boots][-1]

    encoded(range(1 << 40, (1 << 40) + FEW))
    tracemalloc.start()
    last = encoded(range(1 << 41, (1 << 41) + FEW))
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert decode(SampleBlock, last).boot == (1 << 41) + FEW - 1
    assert grown < 25 * FEW
