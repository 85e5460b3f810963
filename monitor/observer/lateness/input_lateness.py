"""How late the inputs act behind where commissioning saw them, learnt from the residual.

A generator that starts again steps at another place between two samples, and one that does not hold
its voltage acts half a sample earlier than one that does. To first order the residual is then τ·s,
with s the response to inputs late by one sample and τ unknown. τ is taken from the residual where
it explains nearly all of it and leaves at most half of what dry friction would. It is learnt while
the rig is not judged and followed slowly afterwards, so that a fault, which is sudden, is not
learnt; what has become constant is kept (`constant_lateness`). Only a motion that is steady is
known to have been recorded; then the healthy residual is known to be smaller than it was taken to
be, and what was seen before decides anew, also where it now deviates. More mass, a spring or a
lower supply may leave the same residual at one frequency. They change size or shape of the motion,
which later inputs only shift: under a drive that was recorded, a lateness is believed if the motion
is the recorded one.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.observer.lateness.constant_lateness import (
    is_another,
    is_constant,
    keep_constant,
    wait_until_constant,
)
from monitor.observer.lateness.lateness_state import (
    AGO,
    COMPARED,
    DENIED,
    EARLIEST,
    ERRORS,
    FOR,
    LATEST,
    OF_QUICK,
    OF_SLOW,
    RATHER,
    RECENT,
    SAME,
    TAU,
    best,
    is_late,
    learn,
    left,
    rubbing,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

EXPLAINS, REST = 0.85, 0.25
"""Share of the residual's energy that it must explain, besides a share of the largest healthy one;
less than that one is not explained at all.
"""
USUAL, MOST_OF_IT = 0.6, 0.5
"""The same when the motion has just become known: what a healthy rig leaves on average, and the
share that must be explained in any case. Later, so little would be a small fault.
"""
SOME_OF_IT = 0.2
"""Share that a lateness explains even while it jumps to another one."""
UNSTEADY = 0.2
"""Lateness, and change of it, that matters [samples]."""
GROWS = 0.6
"""Ratio of the lateness of the slow memory to that of the quick one above which it has grown since
long before: a sudden one reaches it only after the slow memory, a clock's slide at once.
"""
GROWTH = 0.05
"""Difference between the two memories' lateness, about that of half a sample in four seconds."""
SHOWN = 128.0
"""Samples for which a lateness must be found to count, as at a start there may be a false one."""
HALF_SETTLED, SETTLED = 384.0, 768.0
"""Samples of a motion under a recorded drive after which the means of its size and shape contain
so little of the start that twice the limit tells another motion, and nothing of it any more.
"""


@part()
def follow_lateness(  # noqa: PLR0917 -- a kernel
    row: FloatArray,
    largest: float,
    healthy: float,
    judging: bool,
    learns: bool,
    anew: bool,
    kept: FloatArray,
) -> None:
    """Follow the lateness to a sample.

    Args:
        row: its judged columns, see `missing_force`.
        largest: mean square of the healthy residual at the present motion.
        healthy: its variance.
        judging: whether the rig is judged.
        learns: whether the sample counts, or only those before it, as where it deviates.
        anew: whether the motion has just become known.
        kept: the carried figures.
    """
    if learns:
        learn(row, kept)
    if kept[DENIED] > 0.0:
        return
    if is_constant(kept) and judging and not is_another(kept):
        keep_constant(row, healthy, kept)
        return
    first = OF_SLOW if judging and not is_late(kept) and not slides(kept) else OF_QUICK
    energy, found = kept[first + ERRORS], best(kept, first)
    least = (1.0 - EXPLAINS) * energy + REST * largest
    if anew:
        usually = (1.0 - EXPLAINS) * energy + USUAL * largest
        least = max(least, min(usually, (1.0 - MOST_OF_IT) * energy))
    least = min(least, rubbing(0.0, kept, first) / RATHER)
    if energy > largest and left(found, kept, first) < least and EARLIEST < found < LATEST:
        kept[TAU] = found
    else:
        kept[TAU] = _towards_none(kept[TAU], found)
    kept[FOR] = kept[FOR] + 1.0 if abs(kept[TAU]) > UNSTEADY else 0.0
    kept[AGO] = 0.0 if kept[FOR] >= SHOWN else min(kept[AGO] + 1.0, RECENT)
    wait_until_constant(judging, kept)


@part()
def compare_motion(altered: float, calm: bool, kept: FloatArray) -> None:
    """Deny a lateness if the motion is not the recorded one, shifted, or no input can be so late.

    It is compared until its means have settled: friction that begins later changes the size of a
    motion that is late.

    Args:
        altered: deviation of its size and shape, 1 at the limit; 0 if the drive was not recorded.
        calm: whether the rig is judged and has not departed.
        kept: the carried figures.
    """
    if altered == 0.0:
        kept[COMPARED] = kept[DENIED] = 0.0
        return
    if kept[COMPARED] >= SETTLED:
        return
    kept[COMPARED] += 1.0
    if not calm or kept[COMPARED] < HALF_SETTLED or abs(kept[TAU]) <= UNSTEADY:
        return
    limit = 1.0 + (SETTLED - kept[COMPARED]) / (SETTLED - HALF_SETTLED)
    if altered > limit or best(kept, OF_SLOW) in (EARLIEST, LATEST):
        kept[DENIED], kept[TAU], kept[FOR], kept[AGO], kept[SAME] = 1.0, 0.0, 0.0, RECENT, 0.0


@part()
def _towards_none(known: float, found: float) -> float:
    """The known lateness, or less of it if less is found, as where an edge slides past a sample."""
    return min(max(found, 0.0), known) if known > 0.0 else max(min(found, 0.0), known)


@part()
def told_lateness(kept: FloatArray) -> float:
    """The lateness for people [samples]: one that has mattered for a while and stays; else 0."""
    if kept[AGO] > 0.0:
        return 0.0
    if is_constant(kept):
        return kept[TAU]
    stays = abs(best(kept, OF_QUICK) - best(kept, OF_SLOW)) <= GROWTH
    return kept[TAU] if stays else 0.0


@part()
def slides(kept: FloatArray) -> bool:
    """Whether a lateness has grown slowly: the edges of a clock that is almost the rate's.

    It explains nearly all of the newest samples, more than dry friction does.
    """
    found, before = best(kept, OF_QUICK), best(kept, OF_SLOW)
    grown = abs(found) > UNSTEADY and before * np.sign(found) > GROWS * abs(found)
    leaves = left(found, kept, OF_QUICK)
    explains = leaves < (1.0 - EXPLAINS) * kept[OF_QUICK + ERRORS]
    return grown and explains and RATHER * leaves < rubbing(0.0, kept, OF_QUICK)


@part()
def seems_to_grow(kept: FloatArray) -> bool:
    """Whether the newest samples show more of a lateness than those before, or dry friction.

    Either explains most of them, and friction hardly more: of a triangle the two are nearly alike.
    """
    found, before = best(kept, OF_QUICK), best(kept, OF_SLOW)
    more = abs(found) > UNSTEADY and before * np.sign(found) > 0.0
    more = more and abs(found) - abs(before) > GROWTH
    late, rubbed = left(found, kept, OF_QUICK), rubbing(0.0, kept, OF_QUICK)
    most = max(late, rubbed) < MOST_OF_IT * kept[OF_QUICK + ERRORS]
    return more and most and late < RATHER * rubbed


@part()
def seems_late(kept: FloatArray) -> bool:
    """Whether a lateness, and not dry friction, explains the newest samples: a clock may slip."""
    leaves = left(best(kept, OF_QUICK), kept, OF_QUICK)
    most = leaves < MOST_OF_IT * kept[OF_QUICK + ERRORS]
    return most and RATHER * leaves < rubbing(0.0, kept, OF_QUICK)


@part()
def rubs(kept: FloatArray) -> bool:
    """Whether dry friction explains the newest samples better than any lateness does."""
    return rubbing(0.0, kept, OF_QUICK) < left(best(kept, OF_QUICK), kept, OF_QUICK)


@part()
def lateness_changes(kept: FloatArray) -> bool:
    """Whether there is a lateness and the newest samples show another one than those before.

    One that explains hardly anything, or less than dry friction, or is more than inputs can be late
    is none: something else has changed.
    """
    found, before = best(kept, OF_QUICK), best(kept, OF_SLOW)
    if not is_late(kept) or found in (EARLIEST, LATEST) or abs(found - before) <= UNSTEADY:
        return False
    some = left(found, kept, OF_QUICK) < (1.0 - SOME_OF_IT) * kept[OF_QUICK + ERRORS]
    return some and not rubs(kept)
