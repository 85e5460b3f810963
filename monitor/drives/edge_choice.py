"""Whether the edges of an input lie between samples, or its steps jitter, as the motion shows.

Intervals between edges that differ by a sample come from a generator with a clock of its own, or
from one that updates at the instants of sampling at a frequency that does not divide the rate. The
residual tells them apart: taken for each other they leave a response to every edge, which comes and
goes with its place between samples, as no fault does. In the same way it tells readings that repeat
because the steps of a smooth drive jitter from those of a voltage that is held.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

MEMORY = 64.0
"""Of the energies that are compared [samples]."""
CLEAR = 0.3
"""Ratio of the energy left by one assumption to that left by the other below which it is true."""
LASTS = 128.0
"""Memory of what is not known of edges between samples, and time without a choice after which one
is new: steps that jitter show now and then [samples].
"""
SOON = 32.0
"""Memory of whether the choice matters and can be made [samples]."""
OPEN, MATTERS = 2.0 * MEMORY, 0.01
"""Samples for which a choice is open once it can be made: the energies hold what was before; and
energy of what it changes, relative to the healthy residual's, from which it matters.
"""
VAGUE = 0.5
"""Energy of what is not known of the edges, relative to that of what the choice changes, above
which the residual cannot tell.
"""
HELD, BETWEEN, CHOSEN, UNSURE, CHANGES, BLURS, SINCE = range(7)
"""Mean squares of the residual for edges at samples and between them, whether they are between,
mean squares of what is not known of them (over `LASTS`), and over `SOON` of what the choice changes
and of what is not known, and samples since the choice can be made, below 0 since it cannot.
"""


def no_edges() -> FloatArray:
    """The figures at the start."""
    return np.zeros(SINCE + 1)


@part()
def corrected(error: float, moved: float, kept: FloatArray) -> float:
    """The residual of a sample under the assumption that is taken to be true."""
    return error - moved if kept[CHOSEN] > 0.0 else error


@part()
def follow_edges(
    error: float, moved: float, unsure: float, largest: float, kept: FloatArray
) -> bool:
    """Learn from a sample; whether the assumption changes.

    Args:
        error: its residual for edges at samples.
        moved: response of the prediction to edges between samples.
        unsure: response to what is not known of their instants.
        largest: mean square of the healthy residual at the present motion.
        kept: the carried figures.
    """
    kept[HELD] += (error**2 - kept[HELD]) / MEMORY
    kept[BETWEEN] += ((error - moved) ** 2 - kept[BETWEEN]) / MEMORY
    kept[CHANGES] += (moved**2 - kept[CHANGES]) / SOON
    kept[BLURS] += (unsure**2 - kept[BLURS]) / SOON
    if kept[CHANGES] < MATTERS * largest or kept[BLURS] > VAGUE * kept[CHANGES]:
        kept[SINCE] = min(kept[SINCE], 0.0) - 1.0
    elif kept[SINCE] <= 0.0:
        kept[SINCE] = 1.0 if kept[SINCE] <= -LASTS else OPEN + 1.0
    now, other = (HELD, BETWEEN) if kept[CHOSEN] == 0.0 else (BETWEEN, HELD)
    if kept[now] > largest and kept[other] < CLEAR * kept[now]:
        kept[CHOSEN] = 1.0 - kept[CHOSEN]
        return True
    return False


@part()
def undecided(moved: float, kept: FloatArray) -> float:
    """What the residual of a sample may hold until it is told where the edges are; then 0.

    A generator whose clock is almost the rate's shows edges between samples at its first slip, and
    from then on leaves a response to them that is no fault.
    """
    if kept[SINCE] <= 0.0 or kept[SINCE] > OPEN or kept[CHOSEN] > 0.0:
        return 0.0
    kept[SINCE] += 1.0
    return moved


@part()
def edges_unsure(unsure: float, kept: FloatArray) -> float:
    """Mean square of the residual that edges between samples may have left; 0 for edges at samples.

    When they become known, the residual before is no lateness.

    Args:
        unsure: response of the prediction to what is not known of their instants.
        kept: the carried figures.
    """
    kept[UNSURE] += (unsure**2 - kept[UNSURE]) / LASTS
    return kept[UNSURE] if kept[CHOSEN] > 0.0 else 0.0
