"""The online residual: model minus observation, sample by sample, and when it exceeds noise.

    r_j = x_j(model) − x_j(observed)                                                  (4.34)

Two tests: a fixed limit as in the thesis (±0.001), or `threshold.CumulativeSum`, whose false-alarm
rate is calculated.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.structures.damage.innovations import Innovations
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
        calibration: number of undamaged samples behind `sigma`, less what was fitted to them.
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
        learnt: int = 0,
    ) -> Watch:
        """Run the model in parallel with the record.

        Args:
            model: structure and record.
            parameters: current parameters, shape (n_p,).
            state: at sample `first`, shape (n,).
            first, last: the range [samples].
            spread: covariance of the springs' coefficients and the state, shape (c + n, c + n);
                None if they are known.
            learnt: sample before which the record was used to find them.
        """
        run = model.run(parameters, state, first, last)
        residual = run.outputs - model.observed[first:last]
        scaled = residual / self.sigma
        if spread is not None and np.any(spread) and self.limit is None:
            filtered = Innovations(model, parameters, state, spread, self.sigma)
            scaled = filtered.along(model, first, last, learnt)
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


def noise(residual: FloatArray, observed: FloatArray, unknowns: int = 0) -> FloatArray:
    """Standard deviation of undamaged residuals, at least the integration error, shape (m,).

    Args:
        residual: shape (samples, m); NaN where missing, never a whole signal.
        observed: the signals, of the same shape.
        unknowns: number of figures identified from these samples, which took part of the noise.
    """
    count = int(np.isfinite(residual).sum())
    size = np.sqrt(np.nanmean(observed**2, axis=0))
    found = np.sqrt(np.nanmean(residual**2, axis=0) * count / max(count - unknowns, 1))
    return np.asarray(np.maximum(found, FLOOR * size) + 1e-300)
