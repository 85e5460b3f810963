"""The strength at which a hidden effect changes the sensor signals by a given share."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from rigwatch.wire.arrays import FloatArray

LIMIT = 1e6
"""Share that stands for a plant that diverges (NaN or infinite)."""
LEAST, MOST = 1e-9, 1e9
"""Range of strengths that is searched, in the effect's unit."""


def strength_that_causes(share: float, read: Callable[[float], FloatArray]) -> float:
    """The strength at which an effect changes the outputs by `share` of their rms.

    The largest of the shares of all channels counts.

    Args:
        share: for example 0.05.
        read: noise-free sensor signals at a strength, shape (n, outputs); healthy at 0.
    """
    healthy = read(0.0)
    size = np.std(healthy, axis=0)

    def caused(strength: float) -> float:
        return largest_share(read(strength) - healthy, size)

    return strength_at(share, caused)


def largest_share(moved: FloatArray, size: FloatArray) -> float:
    """Largest rms change of a channel relative to its size; `LIMIT` if the plant diverges.

    Args:
        moved: change of the signals, shape (n, outputs).
        size: of each signal, shape (outputs,).
    """
    found = float(np.max(np.sqrt(np.mean(moved**2, axis=0)) / size))
    return found if np.isfinite(found) else LIMIT


def strength_at(share: float, caused: Callable[[float], float], least: float = LEAST) -> float:
    """The strength that causes a share; the last one tried if none does.

    Args:
        share: for example 0.05.
        caused: share that a strength causes.
        least: smallest strength that is tried.
    """
    low = high = least
    while (found := caused(high)) < share and high < MOST:
        low, high = high, high * 4
    if low == high or found < share:
        return high

    def surplus(logarithm: float) -> float:
        return float(np.log(max(caused(np.exp(logarithm)), 1e-12) / share))

    return float(np.exp(brentq(surplus, np.log(low), np.log(high), xtol=1e-3)))
