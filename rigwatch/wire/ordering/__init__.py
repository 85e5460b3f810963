"""Delivery logic without clock or bus: order, losses, and arbitration between sources.

`sample_order` orders received samples and reports losses (`outcomes`), `stream` keeps those of one
boot until their turn, `source_arbitration` decides which of several sources has control,
`ownership` which process may send for it, and `ring_protocol` defines a reader's queries to a ring.
`past_runs` answers them for the earlier runs of a process. Samples and numbered messages use the
same logic. `sender_rates` bounds what each client may send; `set_clock` tells by how much the clock
of samples was set.
"""

from rigwatch.wire.ordering.numbered import Numbered, NumberedRun
from rigwatch.wire.ordering.outcomes import (
    FORGED,
    POSITION_WRONG,
    Counters,
    Loss,
    Outcome,
    Remark,
)
from rigwatch.wire.ordering.ownership import Owners
from rigwatch.wire.ordering.past_runs import PastRun, PastRuns, first_fitting
from rigwatch.wire.ordering.ring_protocol import EMPTY, OPEN, UNKNOWN, Ask, RingReply
from rigwatch.wire.ordering.sample_order import LARGEST_SEQ, SampleOrder
from rigwatch.wire.ordering.sender_rates import SenderRates
from rigwatch.wire.ordering.set_clock import elapsed_ns, set_by_ns

__all__ = [
    "EMPTY",
    "FORGED",
    "LARGEST_SEQ",
    "OPEN",
    "POSITION_WRONG",
    "UNKNOWN",
    "Ask",
    "Counters",
    "Loss",
    "Numbered",
    "NumberedRun",
    "Outcome",
    "Owners",
    "PastRun",
    "PastRuns",
    "Remark",
    "RingReply",
    "SampleOrder",
    "SenderRates",
    "elapsed_ns",
    "first_fitting",
    "set_by_ns",
]
