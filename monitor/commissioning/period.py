"""Periodic recordings: their period, the average period, and the scatter around it."""

from dataclasses import dataclass

import numpy as np

from rigwatch.physics.transfer import shortest_period
from rigwatch.wire.arrays import FloatArray

MATCH = 0.006
"""Allowed rms difference of an excitation one period later, as a share of its amplitude."""
NOISE = 1e-3
"""Noise of a measured voltage that the period has to allow for [V]."""


def period_of(voltage: FloatArray, longest: int) -> int:
    """Period of the voltage in samples, 0 if it does not repeat within `longest`."""
    swing = float(np.std(voltage))
    if swing < 10.0 * NOISE:
        return 0
    tolerance = (MATCH * swing) ** 2 + (3.0 * NOISE) ** 2
    lags = range(4, min(voltage.size // 2, longest) + 1)
    return shortest_period(voltage, lags, lambda _: tolerance)


@dataclass(frozen=True, eq=False)
class Averaged:
    """One average period of several signals.

    Args:
        mean: shape (signals, period).
        scatter: standard deviation around the mean, shape (signals,).
        periods: number of periods averaged.
    """

    mean: FloatArray
    scatter: FloatArray
    periods: int


def averaged(signals: FloatArray, period: int) -> Averaged:
    """Average over at least two whole periods of `signals`, shape (signals, n)."""
    periods = signals.shape[1] // period
    folded = signals[:, : periods * period].reshape(len(signals), periods, period)
    mean = folded.mean(axis=1)
    freedom = period * (periods - 1)
    scatter = np.sqrt(((folded - mean[:, None, :]) ** 2).sum(axis=(1, 2)) / freedom)
    return Averaged(mean, scatter, periods)
