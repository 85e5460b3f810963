"""What comes next, what is missing, whom to believe: the logic of delivery, without clock or bus.

`sample_order` puts what arrives in order and says what is lost, `source_arbitration` decides which
of several sources has control, `ownership` who may speak for it, and `ring_protocol` is what a
reader asks of a ring. Samples and numbered messages go the same way.
"""

from rigwatch.wire.ordering.numbered import Numbered
from rigwatch.wire.ordering.ownership import Owners
from rigwatch.wire.ordering.ring_protocol import OPEN, UNKNOWN, Ask, RingReply
from rigwatch.wire.ordering.sample_order import (
    FORGED,
    LARGEST_SEQ,
    POSITION_WRONG,
    Counters,
    Loss,
    Outcome,
    Remark,
    SampleOrder,
)

__all__ = [
    "FORGED",
    "LARGEST_SEQ",
    "OPEN",
    "POSITION_WRONG",
    "UNKNOWN",
    "Ask",
    "Counters",
    "Loss",
    "Numbered",
    "Outcome",
    "Owners",
    "Remark",
    "RingReply",
    "SampleOrder",
]
