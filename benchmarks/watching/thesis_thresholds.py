"""The thesis's thresholds of the estimates, for the numerical validation.

The thesis uses mean ± 3·sd of the first 50 estimates. That suits its few hundred estimates; at 256
a second a healthy estimate exceeds three standard deviations every second or two, so the monitor
has thresholds of its own (`decision_rules`).
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import FloatArray

THESIS_FACTOR = 3.0


@dataclass(frozen=True, eq=False)
class Thresholds:
    """Limits of (θ1, θ2).

    Args:
        low, high: shape (2,), units of θ.
    """

    low: FloatArray
    high: FloatArray

    def left(self, theta: FloatArray) -> FloatArray:
        """1.0 where an estimate is outside the limits, shape (n,); `theta` of shape (n, 2)."""
        outside = np.any((theta < self.low) | (theta > self.high), axis=1)
        return np.asarray(outside, dtype=np.float64)


def thesis_thresholds(theta: FloatArray) -> Thresholds:
    """mean ± 3·sd of healthy estimates, shape (n, 2), n at least 2."""
    mean, deviation = theta.mean(axis=0), theta.std(axis=0, ddof=1)
    return Thresholds(mean - THESIS_FACTOR * deviation, mean + THESIS_FACTOR * deviation)
