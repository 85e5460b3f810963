"""Every sample is delivered, recovered or reported as lost.

    publisher ──▶ Ring ◀──queries── SampleReader ──▶ SampleOrder ──▶ samples in order, losses
    counted

The logic is in `ordering`, which is also used for alarms and estimates.
"""

from rigwatch.wire.delivery.ring import (
    SOURCE_KEY,
    RingArrays,
    RingStore,
    SampleRing,
)
from rigwatch.wire.delivery.sample_reader import Item, SampleReader
from rigwatch.wire.ordering import LARGEST_SEQ, POSITION_WRONG, Counters

__all__ = [
    "LARGEST_SEQ",
    "POSITION_WRONG",
    "SOURCE_KEY",
    "Counters",
    "Item",
    "RingArrays",
    "RingStore",
    "SampleReader",
    "SampleRing",
]
