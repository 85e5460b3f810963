"""The averages of the places of a period, some of which a line that loses samples never shows.

A line may lose samples in time with the drive. A place without an average is not judged; as soon as
its samples come, it gets one.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from monitor.reference.reference_state import Reference
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

FEWEST_OF_A_PLACE = 2
"""Samples that make the average of a place."""
MOST_UNKNOWN = 8
"""Share of the places, as a divisor, that may lack an average when the reference is armed."""


@part()
def enough_known(ref: Reference) -> bool:
    """Whether so many places have an average that the reference can be armed."""
    unknown = 0
    for place in range(ref.counts.period):
        if ref.seen[place] < FEWEST_OF_A_PLACE:
            unknown += 1
    return unknown * MOST_UNKNOWN <= ref.counts.period


@part()
def average(ref: Reference) -> None:
    """Compute the averages; a place that was never seen lies on the line between the nearest."""
    period = ref.counts.period
    for i in range(4):
        for place in range(period):
            if ref.seen[place] > 0:
                ref.template[i, place] = ref.sums[i, place] / ref.seen[place]
    for place in range(period):
        if ref.seen[place] == 0:
            _interpolate(ref, place, period)


@part()
def _interpolate(ref: Reference, place: int, period: int) -> None:
    before = after = 1
    while ref.seen[(place - before) % period] == 0:
        before += 1
    while ref.seen[(place + after) % period] == 0:
        after += 1
    share = before / (before + after)
    for i in range(4):
        first = ref.template[i, (place - before) % period]
        last = ref.template[i, (place + after) % period]
        ref.template[i, place] = (1.0 - share) * first + share * last


@part(inline="always")
def is_known(ref: Reference, place: int) -> bool:
    """Whether this place has an average."""
    return ref.seen[place] >= FEWEST_OF_A_PLACE


@part()
def get_to_know(ref: Reference, place: int, row: FloatArray) -> None:
    """Add one clearly healthy sample of a place without an average."""
    ref.seen[place] += 1
    for i in range(4):
        ref.template[i, place] += (row[i] - ref.template[i, place]) / ref.seen[place]
