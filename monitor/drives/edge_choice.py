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
from numba import njit

from rigwatch.wire.arrays import FloatArray

MEMORY = 64.0
"""Of the energies that are compared [samples]."""
CLEAR = 0.3
"""Ratio of the energy left by one assumption to that left by the other below which it is true."""
LASTS = 128.0
"""Memory of what is not known of edges between samples [samples]."""
HELD, BETWEEN, CHOSEN, UNSURE = range(4)
"""Mean squares of the residual for edges at samples and between them, whether they are between, and
mean square of what is not known of them.
"""


def no_edges() -> FloatArray:
    """The figures at the start."""
    return np.zeros(UNSURE + 1)


@njit()
def corrected(error: float, moved: float, kept: FloatArray) -> float:
    """The residual of a sample under the assumption that is taken to be true."""
    return error - moved if kept[CHOSEN] > 0.0 else error


@njit()
def follow_edges(error: float, moved: float, largest: float, kept: FloatArray) -> bool:
    """Learn from a sample; whether the assumption changes.

    Args:
        error: its residual for edges at samples.
        moved: response of the prediction to edges between samples.
        largest: mean square of the healthy residual at the present motion.
        kept: the carried figures.
    """
    kept[HELD] += (error**2 - kept[HELD]) / MEMORY
    kept[BETWEEN] += ((error - moved) ** 2 - kept[BETWEEN]) / MEMORY
    now, other = (HELD, BETWEEN) if kept[CHOSEN] == 0.0 else (BETWEEN, HELD)
    if kept[now] > largest and kept[other] < CLEAR * kept[now]:
        kept[CHOSEN] = 1.0 - kept[CHOSEN]
        return True
    return False


@njit()
def edges_unsure(unsure: float, kept: FloatArray) -> float:
    """Mean square of the residual that edges between samples may have left; 0 for edges at samples.

    When they become known, the residual before is no lateness.

    Args:
        unsure: response of the prediction to what is not known of their instants.
        kept: the carried figures.
    """
    kept[UNSURE] += (unsure**2 - kept[UNSURE]) / LASTS
    return kept[UNSURE] if kept[CHOSEN] > 0.0 else 0.0
