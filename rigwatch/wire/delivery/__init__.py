"""Every sample is delivered, recovered or reported as lost.

    publisher ──▶ Ring ◀──asks── SampleReader ──▶ SampleOrder ──▶ samples in order, losses counted

`source_arbitration` decides which of several sources of samples has control of a rig, `ownership`
who may send the samples of one.
"""

from rigwatch.wire.delivery.ring import SampleRing
from rigwatch.wire.delivery.sample_order import LARGEST_SEQ, POSITION_WRONG, Counters
from rigwatch.wire.delivery.sample_reader import SampleReader

__all__ = ["LARGEST_SEQ", "POSITION_WRONG", "Counters", "SampleReader", "SampleRing"]
