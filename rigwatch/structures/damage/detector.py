"""The online residual: model minus observation, sample by sample, and when it exceeds noise.

    r_j = x_j(model) − x_j(observed)                                                  (4.34)

Two tests: a fixed limit as in the thesis (±0.001), or `threshold.CumulativeSum`, whose false-alarm
rate is calculated.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.structures.damage.spring_model import SpringModel
from rigwatch.structures.damage.threshold import CumulativeSum, threshold_for
from rigwatch.wire.arrays import FloatArray

FLOOR = 1e-4
"""Share of a signal's rms below which its residual counts as integration error."""
RATE = 0.01
"""Probability of any false alarm in a whole record."""


@dataclass(frozen=True)
class Alarm:
    """The moment at which the residual becomes too large.

    Attributes:
        sample: sample at which it is detected.
        onset: first sample of the excess that led to it.
    """

    sample: int
    onset: int


@dataclass(frozen=True, eq=False)
class Watch:
    """The result of monitoring a record.

    Attributes:
        first: the first sample.
        residual: model minus observed, shape (samples, m).
        states: of the model, shape (samples, n).
        statistic: cumulative sum, or the largest residual over the limit, shape (samples,).
        threshold: threshold of the statistic.
        alarm: None if there was none.
    """

    first: int
    residual: FloatArray
    states: FloatArray
    statistic: FloatArray
    threshold: float
    alarm: Alarm | None


@dataclass(frozen=True, eq=False)
class Judge:
    """The test of residuals.

    Attributes:
        sigma: standard deviation of each signal's residual, shape (m,).
        calibration: number of undamaged samples behind `sigma`.
        rate: probability of a false alarm over a whole record.
        limit: fixed limit instead [the signals' units]; None for the cumulative sum.
    """

    sigma: FloatArray
    calibration: int
    rate: float = RATE
    limit: float | None = None

    def watch(
        self,
        model: SpringModel,
        parameters: FloatArray,
        state: FloatArray,
        first: int,
        last: int,
        *,
        spread: FloatArray | None = None,
    ) -> Watch:
        """Run the model in parallel with the record.

        Args:
            model: structure and record.
            parameters: current parameters, shape (n_p,).
            state: at sample `first`, shape (n,).
            first, last: the range [samples].
            spread: covariance of the springs' coefficients and the state, shape (c + n, c + n);
                None if they are known.
        """
        run = model.run(parameters, state, first, last)
        residual = run.outputs - model.observed[first:last]
        scaled = residual / self.sigma
        if spread is not None and np.any(spread) and self.limit is None:
            scaled = innovations(scaled, run.slopes / self.sigma[:, None], spread)
        statistic, threshold, alarm = self.judge(residual, scaled, first)
        return Watch(first, residual, run.states, statistic, threshold, alarm)

    def judge(
        self, residual: FloatArray, scaled: FloatArray, first: int = 0
    ) -> tuple[FloatArray, float, Alarm | None]:
        """Statistic (samples,), threshold and first alarm of residuals (samples, m).

        `scaled`, of the same shape, have standard deviation 1 if they are only noise.
        """
        if self.limit is not None:
            return _by_limit(residual, self.limit, first)
        samples, signals = residual.shape
        threshold = threshold_for(self.rate, signals, rounded(samples), self.calibration)
        adding = CumulativeSum(signals, threshold)
        statistic, alarm = np.zeros(samples), None
        for k in range(samples):
            if adding.update(scaled[k]) and alarm is None:
                alarm = Alarm(first + k, first + k + 1 - adding.zero)
            statistic[k] = adding.value
        return statistic, threshold, alarm


def innovations(scaled: FloatArray, slopes: FloatArray, spread: FloatArray) -> FloatArray:
    """The part of the residuals that past samples and parameter uncertainty do not explain.

    A parameter error θ moves all residuals together, by slopes·θ, so they are not independent.
    Updating the estimate of θ sample by sample leaves independent innovations (R. E. Kalman,
    1960); each is divided by the root of its covariance.

    Args:
        scaled: residuals over their standard deviation, NaN where missing, shape (samples, m).
        slopes: derivatives by θ, scaled alike, shape (samples, m, p).
        spread: covariance of θ, shape (p, p).

    Returns:
        Shape (samples, m), standard deviation 1 and independent if they are only noise.
    """
    filtered, found = Innovations(spread), np.empty(scaled.shape)
    for k, row in enumerate(scaled):
        found[k] = filtered.update(row, slopes[k])
    return found


class Innovations:
    """`innovations` one sample at a time.

    Args:
        spread: covariance of the parameter errors θ, shape (p, p).
    """

    def __init__(self, spread: FloatArray) -> None:
        self._used = np.flatnonzero(np.diag(spread) > 0)
        # In units of their standard deviations: stiffnesses and positions differ by many orders.
        self._size = np.sqrt(np.diag(spread)[self._used])
        self._covariance = spread[np.ix_(self._used, self._used)] / np.outer(self._size, self._size)
        self._theta = np.zeros(len(self._used))

    def update(self, scaled: FloatArray, slopes: FloatArray) -> FloatArray:
        """One sample's innovations (m,) from scaled residuals (m,) and slopes (m, p)."""
        found, seen = np.full(scaled.shape, np.nan), np.isfinite(scaled)
        if not seen.any():
            return found
        if not len(self._used):
            return scaled
        along = slopes[np.ix_(seen, self._used)] * self._size
        across = self._covariance @ along.T
        root = np.linalg.cholesky(along @ across + np.eye(int(seen.sum())))
        new = np.linalg.solve(root, scaled[seen] - along @ self._theta)
        gain = np.linalg.solve(root, across.T)
        self._theta = self._theta + gain.T @ new
        left = self._covariance - gain.T @ gain
        self._covariance = 0.5 * (left + left.T)
        found[seen] = new
        return found


def _by_limit(
    residual: FloatArray, limit: float, first: int
) -> tuple[FloatArray, float, Alarm | None]:
    statistic = np.nanmax(np.abs(np.nan_to_num(residual)), axis=1) / limit
    over = np.flatnonzero(statistic > 1.0)
    alarm = Alarm(first + int(over[0]), first + int(over[0])) if len(over) else None
    return statistic, 1.0, alarm


def rounded(samples: int) -> int:
    """Rounded up to one of a few lengths, so that few thresholds are computed."""
    return int(100 * np.ceil(samples / 100))


def noise(residual: FloatArray, observed: FloatArray) -> FloatArray:
    """Standard deviation of undamaged residuals, at least the integration error, shape (m,)."""
    size = np.sqrt(np.nanmean(observed**2, axis=0))
    found = np.sqrt(np.nanmean(residual**2, axis=0))
    return np.asarray(np.maximum(np.nan_to_num(found), FLOOR * np.nan_to_num(size)) + 1e-300)
