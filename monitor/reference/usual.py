"""What is usual for the signals where samples are missing: the same place of an earlier period.

Voltage, position and acceleration at the edge of a square wave cannot be interpolated, but they
were measured one period earlier.
"""

import numpy as np

from monitor.reference.reference_state import (
    ARMED,
    FROM_MODEL,
    FROM_RUN,
    LEARNING,
    RESUMING,
    Reference,
)
from rigwatch.wire.arrays import FloatArray


def usual(ref: Reference, first: int, count: int) -> FloatArray:
    """V, x and a from sample `first` on, shape (count, 3); zeros without a period.

    Args:
        ref: the reference, which has taken the samples before the last of them.
        first: number of the last good sample before the gap.
        count: samples from it to the first good one after the gap.
    """
    counts = ref.counts
    found = np.zeros((count, 3))
    periodic = counts.source in (FROM_MODEL, FROM_RUN)
    if periodic and counts.mode in (ARMED, RESUMING):
        places = (first - counts.anchor + np.arange(count)) % counts.period
        return np.ascontiguousarray(ref.template[:3, places].T)
    if periodic and counts.mode == LEARNING and counts.period > 1:
        ago = count - 2 - np.arange(count) + counts.period
        voltage = ref.ring[(counts.ring_head - 1 - ago) % ref.ring.size]
        if ago[0] < counts.ring_fill and not np.isnan(voltage).any():
            found[:, 0] = voltage
    return found
