"""Periodic recordings: their period, one average period, and the scatter about it."""

from dataclasses import dataclass

import numpy as np

from rigwatch.physics.transfer import shortest_period
from rigwatch.wire.arrays import FloatArray

MATCH = 0.006
"""Rms by which an excitation may differ from itself one period later, as a share of its swing."""


def period_of(voltage: FloatArray, longest: int, noise: float = 1e-3) -> int:
    """Samples after which the voltage repeats, 0 where it does not within `longest`."""
    swing = float(np.std(voltage))
    if swing < 10.0 * noise:
        return 0
    tolerance = (MATCH * swing) ** 2 + (3.0 * noise) ** 2
    lags = range(4, min(voltage.size // 2, longest) + 1)
    return shortest_period(voltage, lags, lambda _: tolerance)


@dataclass(frozen=True, eq=False)
class Averaged:
    """One average period of several signals.

    Args:
        mean: shape (signals, period).
        scatter: standard deviation about the mean, shape (signals,).
        periods: how many were averaged.
    """

    mean: FloatArray
    scatter: FloatArray
    periods: int


def averaged(signals: FloatArray, period: int) -> Averaged:
    """Average of whole periods of `signals`, shape (signals, n), from the first sample on; at
    least two periods.
    """
    periods = signals.shape[1] // period
    folded = signals[:, : periods * period].reshape(len(signals), periods, period)
    mean = folded.mean(axis=1)
    freedom = period * (periods - 1)
    scatter = np.sqrt(((folded - mean[:, None, :]) ** 2).sum(axis=(1, 2)) / freedom)
    return Averaged(mean, scatter, periods)
