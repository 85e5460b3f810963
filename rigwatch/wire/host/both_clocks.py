"""Unix and monotonic time of one moment.

A process that is interrupted between two readings would take the interruption for a step of the
wall clock, so the monotonic clock is read before and after.
"""

import time
from collections.abc import Callable

INTERRUPTED_NS = 10_000_000
"""Time between readings above which they are repeated [ns]."""
MOST_READINGS = 5


def both_clocks(
    wall: Callable[[], int] = time.time_ns, steady: Callable[[], int] = time.monotonic_ns
) -> tuple[int, int]:
    """Unix and monotonic time [ns], of the least interrupted of several readings.

    Args:
        wall, steady: the clocks [ns].
    """
    best, shortest = (0, 0), None
    for _ in range(MOST_READINGS):
        before, at, after = steady(), wall(), steady()
        took = after - before
        if shortest is None or took < shortest:
            best, shortest = (at, before + took // 2), took
        if took <= INTERRUPTED_NS:
            break
    return best
