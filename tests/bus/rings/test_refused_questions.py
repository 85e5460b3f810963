"""Questions that are none: no answer, and each is counted by the process that was asked."""

import pytest

from rigwatch.wire.bus.memory_transport import MemoryNetwork
from rigwatch.wire.bus.message_ring import ring_key
from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.messages import ALARMS, ESTIMATES, RING_KEY
from rigwatch.wire.ordering import OPEN, Ask
from tests.bus.samples import block


@pytest.mark.parametrize("question", [b"", b"what", bytes(10_000)], ids=["empty", "short", "long"])
@pytest.mark.parametrize("key", [RING_KEY, ring_key("daq", ALARMS), ring_key("daq", ESTIMATES)])
def test_a_ring_counts_what_is_no_question(key: str, question: bytes) -> None:
    network = MemoryNetwork()
    asked, stranger = network.bus("rig", "daq"), network.bus("rig", "stranger")
    asked.announce()
    ring = SampleRing(asked, 100)
    ring.add(block(0, 10))

    assert stranger.query(key, Ask(7, 0, OPEN).to_bytes())
    assert asked.questions_refused == 0
    assert stranger.query(key, question) == []
    assert stranger.query(key, question) == []
    assert asked.questions_refused == 2
    assert stranger.questions_refused == 0
