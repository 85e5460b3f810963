"""A lateness that stays the same, and friction that begins beside it.

A generator that is locked to the DAQ is late by the same part of a sample for as long as it runs:
once that is known, it is no noise but a parameter of the inputs. Dry friction often looks like less
of it, and would be learnt as such. A constant lateness is therefore kept, but for what clocks drift
by, until the newest samples show another one better than friction beside it. Of inputs that are
early the response is less accurate: theirs is followed as before.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from monitor.observer.lateness.late_response import forget_accuracy, measure_accuracy
from monitor.observer.lateness.lateness_state import (
    AT_FIRST,
    OF_QUICK,
    OF_SLOW,
    RATHER,
    SAME,
    TAU,
    best,
    left,
    rubbing,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

NEAR, CONSTANT = 0.1, 384.0
"""Difference up to which a lateness is the same [samples], and samples for which one that is
constant has been: that of a clock that is 0.1 % off moves by four times as much.
"""
CREEP = 2e-4
"""Largest change of a constant lateness a sample [samples]: of a clock that is 0.02 % off."""


@part()
def is_constant(kept: FloatArray) -> bool:
    """Whether there is a lateness that has been the same for long."""
    return kept[SAME] >= CONSTANT


@part()
def wait_until_constant(judging: bool, kept: FloatArray) -> None:
    """Follow for how long a lateness that is not constant has been the same.

    Args:
        judging: whether the rig is judged.
        kept: the carried figures.
    """
    same = judging and kept[TAU] > 0.0
    same = same and abs(best(kept, OF_QUICK) - kept[AT_FIRST]) <= NEAR
    same = same and abs(best(kept, OF_SLOW) - kept[AT_FIRST]) <= NEAR
    kept[SAME] = kept[SAME] + 1.0 if same else 0.0
    if kept[SAME] == 0.0:
        kept[AT_FIRST] = best(kept, OF_SLOW)
    forget_accuracy(kept)
    if is_constant(kept):
        kept[TAU] = best(kept, OF_SLOW)


@part()
def keep_constant(row: FloatArray, healthy: float, kept: FloatArray) -> None:
    """Keep a constant lateness, and learn from a sample how accurate its response is.

    Args:
        row: its judged columns, see `missing_force`.
        healthy: variance of the healthy residual at the present motion.
        kept: the carried figures.
    """
    kept[SAME] += 1.0
    if left(best(kept, OF_SLOW), kept, OF_SLOW) < RATHER * rubbing(kept[TAU], kept, OF_SLOW):
        more = best(kept, OF_SLOW) - kept[TAU]
        kept[TAU] += min(max(more, -CREEP), CREEP)
    measure_accuracy(row, healthy, kept[SAME] - CONSTANT, kept)


@part()
def is_another(kept: FloatArray) -> bool:
    """Whether the newest samples show another lateness, and not friction beside this one."""
    found = best(kept, OF_QUICK)
    leaves = left(found, kept, OF_QUICK)
    return abs(found - kept[TAU]) > NEAR and RATHER * leaves < rubbing(kept[TAU], kept, OF_QUICK)


@part()
def rubs_beside(kept: FloatArray) -> bool:
    """Whether friction beside this lateness explains the newest samples better than another one."""
    leaves = left(best(kept, OF_QUICK), kept, OF_QUICK)
    return rubbing(kept[TAU], kept, OF_QUICK) < leaves
