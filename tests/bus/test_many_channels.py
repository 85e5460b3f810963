"""Rigs with more channels than a block of usual length can carry."""

import numpy as np
import pytest

from rigwatch.wire.bus import MAX_PAYLOAD
from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.delivery import SampleReader, SampleRing
from rigwatch.wire.delivery.ring import RingStore
from rigwatch.wire.messages import SAMPLES, BlockSize, Column, SampleBlock, encode
from rigwatch.wire.ordering import Ask
from tests.waiting import eventually

NAME = "pressure_of_the_upper_chamber_"


def wide(seq: int, n: int, channels: int) -> SampleBlock:
    """Samples with readings that no encoding shortens, at the latest time that there is."""
    chance = np.random.default_rng(seq)
    last = np.full(n, np.iinfo(np.int64).max)
    columns = tuple(
        Column(f"{NAME}{k}", "Pa", chance.normal(size=n), np.full(n, 255, np.uint8))
        for k in range(channels)
    )
    return SampleBlock("rig", 7, seq, last, last, columns)


@pytest.mark.parametrize("channels", [1, 3, 64, 300])
def test_a_block_that_fits_is_no_longer_than_foreseen(channels: int) -> None:
    size = BlockSize.of(wide(0, 1, channels))
    most = size.samples_in(MAX_PAYLOAD)
    assert 0.7 * MAX_PAYLOAD < len(encode(wide(0, most, channels))) <= MAX_PAYLOAD


@pytest.mark.parametrize(
    ("channels", "apart"),
    [(3, 1), (3, 2), (64, 1), (64, 2), pytest.param(300, 1, marks=pytest.mark.nightly), (300, 2)],
)
def test_a_reply_of_a_ring_fits_the_bus_and_the_next_goes_on(channels: int, apart: int) -> None:
    """Each sample alone, or every other: then each is a block of its own, with all the names."""
    ring, found = RingStore(wide(0, 1, channels), 1500), []
    for seq in range(0, 1500, apart):
        ring.add(wide(seq, 1, channels))
    settled = -1
    while settled < 1498:
        reply = ring.reply(Ask(7, settled + 1, 1499))
        assert reply.settled > settled
        assert len(reply.to_bytes()) <= MAX_PAYLOAD
        settled = reply.settled
        found += [seq for part in reply.blocks for seq in range(part.seq, part.seq + len(part))]
    assert found == list(range(0, 1500, apart))


def test_a_reader_that_was_away_gets_every_sample_of_64_channels() -> None:
    network = MemoryNetwork()
    daq, monitor = network.bus("bench", "daq"), network.bus("bench", "monitor")
    ring, reader = SampleRing(daq, 4096), SampleReader(monitor, (7, 9), 0)
    for seq in range(0, 1000, 100):
        ring.add(wide(seq, 100, 64))
    daq.publish(SAMPLES, wide(900, 100, 64))

    def complete() -> bool:
        reader.read(0.02)
        return reader.counters.delivered + reader.counters.lost >= 990

    eventually(complete, "every sample is delivered or lost")
    assert (reader.counters.delivered, reader.counters.lost) == (990, 0)
    reader.close()
