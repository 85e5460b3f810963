"""The response to inputs that act late, and how accurate it is.

An input that is held and late by a part of a sample gains, of the steps on both sides of that, only
the one before. The response to the mean of both is half a sample too early: at 8 Hz and 256 Hz it
would be wrong by a tenth, of which much looks like friction; and it divides each edge of a square
wave between two samples, where it explains hardly half of what such inputs leave. One that is early
gains the step after, or less of the one before if it was late when commissioned: its response stays
that to both. What it is wrong by besides, as equations fitted to one lateness are at another, is
found from what a constant lateness leaves.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.observer.lateness.lateness_state import (
    ALLOWED,
    LEAVES,
    OF_SLOW,
    REFUTED,
    TAU,
    best,
    is_late,
)
from monitor.observer.missing_force import LATE_UNIT, E
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

UNSURE = 0.15
"""Relative error of the response: equations fitted to one lateness are less accurate at another."""
HALF = 0.5
"""Mean lateness of inputs that slide past the samples."""
MEASURED = 256.0
"""Samples of a constant lateness after which they have shown the error, and their memory."""
USUAL = 2.0
"""Mean square of a healthy residual without that error, relative to its variance: a little more
than it leaves on average.
"""
SAFE = 2.0
"""Ratio of the energy that is allowed for to the one that was found."""


@part()
def response_to(both: float, before: float, kept: FloatArray) -> float:
    """The response to inputs that act later; to the steps on both sides if they seem to be early.

    Args:
        both: that to the steps on both sides of the sample, for a lateness of one sample.
        before: that to the step before it.
        kept: the carried figures.
    """
    late = kept[TAU] > 0.0 or (kept[TAU] == 0.0 and best(kept, OF_SLOW) > 0.0)
    return before if late else both


@part()
def unsure_lateness(kept: FloatArray) -> float:
    """Lateness to which what is not known of it amounts, as the response is not accurate [samples].

    Of inputs that slide, at least that of half a sample: where an edge is close to a sample, some
    act before it and some after it.
    """
    return _unmeasured(kept) * np.sqrt(1.0 - kept[REFUTED])


@part()
def _unmeasured(kept: FloatArray) -> float:
    return UNSURE * (max(abs(kept[TAU]), HALF) if is_late(kept) else abs(kept[TAU]))


@part()
def forget_accuracy(kept: FloatArray) -> None:
    """Begin anew, with another lateness."""
    kept[LEAVES] = kept[ALLOWED] = kept[REFUTED] = 0.0


@part()
def measure_accuracy(row: FloatArray, healthy: float, age: float, kept: FloatArray) -> None:
    """Learn from a sample at a constant lateness.

    What is allowed for does not grow, as a fault may.

    Args:
        row: its judged columns, see `missing_force`.
        healthy: variance of the healthy residual at the present motion.
        age: samples for which the lateness has been constant, from 1.
        kept: the carried figures.
    """
    memory = min(age, MEASURED)
    leaves = (row[E] - kept[TAU] * row[LATE_UNIT]) ** 2 - USUAL * healthy
    allowed = (_unmeasured(kept) * row[LATE_UNIT]) ** 2
    kept[LEAVES] += (leaves - kept[LEAVES]) / memory
    kept[ALLOWED] += (allowed - kept[ALLOWED]) / memory
    if age >= MEASURED and kept[ALLOWED] > 0.0:
        refuted = 1.0 - min(max(SAFE * kept[LEAVES] / kept[ALLOWED], 0.0), 1.0)
        kept[REFUTED] = max(refuted, kept[REFUTED])
