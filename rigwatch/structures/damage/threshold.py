"""Tests residuals against noise: a cumulative sum with a calculated false-alarm rate.

Residuals r_j of m signals, over their standard deviations σ_j, give z = Σ_j (r_j/σ_j)² ~ χ²(m)
while nothing has changed. The cumulative sum (E. S. Page, 1954)

    S ← max(0, S + z − κ·m),   alarm where S > h

falls by κ·m per sample, so that a lasting excess accumulates and single large samples do not.
Between 0 and h it is a Markov chain (D. Brook and D. A. Evans, 1972); the probability that it
crosses h within n samples is exact except for the grid. If the σ_j are estimated from c undamaged
samples, the probability is averaged over their error: z is too large by c/(c − 2) on average, with
a scatter of √(2/(c·m)).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from rigwatch.wire.arrays import FloatArray

FORGETTING = 1.2
"""κ: average level that does not accumulate."""
GRID = 160
"""States of the chain."""
SCALES = 9
"""Values of the noise scale over which the rate is averaged."""


@dataclass(eq=False)
class CumulativeSum:
    """The cumulative sum, one sample at a time.

    Attributes:
        signals: number m of signals.
        threshold: h.
        value: S.
        zero: samples since S was 0.
    """

    signals: int
    threshold: float
    value: float = 0.0
    zero: int = 0

    def update(self, scaled: FloatArray) -> bool:
        """Add one sample's residuals over their standard deviations, NaN where invalid."""
        squares = scaled**2
        # A missing signal counts as an average one and changes nothing.
        energy = float(np.sum(np.where(np.isnan(squares), 1.0, squares)))
        self.value = max(0.0, self.value + energy - FORGETTING * self.signals)
        self.zero = 0 if self.value == 0.0 else self.zero + 1
        return self.value > self.threshold


@lru_cache(maxsize=256)
def threshold_for(rate: float, signals: int, samples: int, calibration: int = 0) -> float:
    """The h at which the probability of any false alarm is `rate`.

    Args:
        rate: probability over the whole record, between 0 and 1.
        signals: number m of signals.
        samples: length n of the record.
        calibration: undamaged samples c behind the σ_j; 0 if the σ_j are known.
    """

    def surplus(h: float) -> float:
        return float(np.log(false_alarm(h, signals, samples, calibration) / rate))

    low, high = 1e-3, 4.0 * signals
    if surplus(low) < 0:
        return low
    while surplus(high) > 0:
        high *= 2.0
    return float(brentq(surplus, low, high, xtol=1e-3))


def false_alarm(threshold: float, signals: int, samples: int, calibration: int = 0) -> float:
    """Probability of an alarm within `samples` under noise alone."""
    if not calibration:
        return _leaving(threshold, signals, samples, 1.0)
    count = max(calibration, 4)
    points, weights = np.polynomial.hermite_e.hermegauss(SCALES)
    # Residuals are divided by the estimated noise: 1/σ² is too large on average, and
    # scatters; the signals' errors average out.
    scales = count / (count - 2) * np.exp(points * np.sqrt(2.0 / (count * signals)))
    rates = [_leaving(threshold, signals, samples, float(s)) for s in scales]
    return float(weights @ np.array(rates) / weights.sum())


def _leaving(threshold: float, signals: int, samples: int, scale: float) -> float:
    """The same if z is `scale` times χ²(m)."""
    width = threshold / GRID
    levels = np.concatenate([[0.0], (np.arange(GRID) + 0.5) * width])
    edges = np.concatenate([[0.0], np.arange(GRID + 1) * width])
    step = edges[None, :] - levels[:, None] + FORGETTING * signals
    below = chi2.cdf(step / scale, signals)
    # The first state is 0: everything that falls to 0 or below.
    chain = np.diff(below, axis=1)
    chain[:, 0] = below[:, 0]
    stays = np.linalg.matrix_power(chain, samples)[0].sum()
    return float(np.clip(1.0 - stays, 1e-300, 1.0))
