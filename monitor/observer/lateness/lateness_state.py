"""What is carried of the inputs' lateness, and the means that it is learnt from.

With e the residual, s the response to inputs late by one sample and g that to dry friction, the
means of e², e·s, s², e·g, g² and s·g give what any lateness, or friction beside one, leaves of e.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.observer.missing_force import DRY_UNIT, LATE_UNIT, E
from monitor.signals import fill
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

LATEST, EARLIEST = 1.15, -1.25
"""Largest lateness either way [samples]: that of a held voltage, the relative error of the response
(`UNSURE`), and what the response, which is that to later inputs, lacks for earlier ones.
"""
QUICK, SLOW = 32.0, 128.0
"""Memory of what it is learnt from, before and while the rig is judged [samples]."""
RATHER = 2.0
"""Ratio of what dry friction leaves to what it leaves above which it is a lateness: where both
explain the residual, friction is an alarm and a lateness hides one.
"""
RECENT = 4096.0
"""Samples after which a lateness that is no longer found is forgotten: the longest interval between
skips.
"""
ERRORS, PRODUCTS, RESPONSES, RUBBED, FRICTIONS, SHARED = range(6)
"""Means of e², e·s, s², e·g, g² and s·g."""
OF_QUICK, OF_SLOW = 0, 6
"""Where the means with both memories begin."""
(
    TAU, FOR, AGO, COMPARED, DENIED, SAME, AT_FIRST, LEAVES, ALLOWED, REFUTED, FIGURES,
) = range(12, 23)  # fmt: skip
"""Further figures: τ, the time for which it has mattered, the time since it did, `RECENT` if never,
that for which the motion could be compared, and whether it is another one; the time for which the
lateness has been the same, and the first that was; of a constant one means of the energy that it
leaves beyond the usual one and of that which is allowed for, and the share of the latter that is
not there; and the number of figures.
"""


def no_lateness() -> FloatArray:
    """The figures at the start."""
    kept = np.zeros(FIGURES)
    kept[AGO] = RECENT
    return kept


@part()
def forget_lateness(kept: FloatArray) -> None:
    """Begin anew."""
    fill(kept, 0.0)
    kept[AGO] = RECENT


@part()
def is_late(kept: FloatArray) -> bool:
    """Whether there is or was a lateness, which may change."""
    return kept[AGO] < RECENT


@part()
def learn(row: FloatArray, kept: FloatArray) -> None:
    """Add a sample to the means.

    Args:
        row: its judged columns, see `missing_force`.
        kept: the carried figures.
    """
    for first, memory in ((OF_QUICK, QUICK), (OF_SLOW, SLOW)):
        _average(row[E] * row[E], first + ERRORS, memory, kept)
        _average(row[E] * row[LATE_UNIT], first + PRODUCTS, memory, kept)
        _average(row[LATE_UNIT] * row[LATE_UNIT], first + RESPONSES, memory, kept)
        _average(row[E] * row[DRY_UNIT], first + RUBBED, memory, kept)
        _average(row[DRY_UNIT] * row[DRY_UNIT], first + FRICTIONS, memory, kept)
        _average(row[LATE_UNIT] * row[DRY_UNIT], first + SHARED, memory, kept)


@part()
def _average(value: float, place: int, memory: float, kept: FloatArray) -> None:
    kept[place] += (value - kept[place]) / memory


@part()
def best(kept: FloatArray, first: int) -> float:
    """The lateness that explains most."""
    found = kept[first + PRODUCTS] / max(kept[first + RESPONSES], 1e-300)
    return min(max(found, EARLIEST), LATEST)


@part()
def left(tau: float, kept: FloatArray, first: int) -> float:
    """Mean square of the residual without a lateness."""
    explained = tau * (2.0 * kept[first + PRODUCTS] - tau * kept[first + RESPONSES])
    return kept[first + ERRORS] - explained


@part()
def rubbing(tau: float, kept: FloatArray, first: int) -> float:
    """Mean square of the residual without a lateness and the dry friction that explains most."""
    force = max(kept[first + RUBBED] - tau * kept[first + SHARED], 0.0)
    return left(tau, kept, first) - force**2 / max(kept[first + FRICTIONS], 1e-300)
