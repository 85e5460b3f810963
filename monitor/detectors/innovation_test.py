"""A statistical test of an innovation sequence: is the model still right?

With the right model the innovations ν are white and νᵀ·S⁻¹·ν is chi-square with m degrees of
freedom (Mehra and Peschon 1971; Bar-Shalom, Li and Kirubarajan 2001, section 5.4).

    sum of N of them > χ²(N·m; 1 - α)      mean or size of the innovations is wrong

α is the probability of a false alarm in one window. The window slides; windows that do not overlap
are independent.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part


class NisWindow(NamedTuple):
    """The last N normalised innovations squared.

    Attributes:
        values: ring, shape (N,).
        total: their sum, shape (1,).
        place: next place in the ring; how many are in it, shape (2,).
    """

    values: FloatArray
    total: FloatArray
    place: NDArray[np.int64]


def new_nis_window(length: int) -> NisWindow:
    """An empty window over `length` samples."""
    return NisWindow(np.zeros(length), np.zeros(1), np.zeros(2, np.int64))


@part()
def clear_nis(window: NisWindow) -> None:
    """Empty the window."""
    for k in range(window.values.size):
        window.values[k] = 0.0
    window.total[0] = 0.0
    window.place[0] = window.place[1] = 0


@kernel(allocates=True)
def push_nis(window: NisWindow, nis: float) -> float:
    """Add one; the sum over the window, NaN until it is full.

    The sum is recomputed at each turn of the ring, so that rounding errors do not accumulate.
    """
    values, total, place = window
    total[0] += nis - values[place[0]]
    values[place[0]] = nis
    place[0] += 1
    place[1] = min(place[1] + 1, values.size)
    if place[0] == values.size:
        place[0] = 0
        total[0] = values.sum()
    return float(total[0]) if place[1] == values.size else np.nan


def nis_limit(length: int, measurements: int, false_alarm: float) -> float:
    """Limit of the sum over `length` samples of `measurements` each, at `false_alarm`."""
    return float(chdtri(length * measurements, false_alarm))
