"""The residual on line: model less observed, sample by sample, and when it is no noise any more.

    r_j = x_j(model) − x_j(observed)                                                  (4.34)

Two ways to judge it: a fixed limit as in the thesis (±0.001), or `damage_threshold.CumulativeSum`,
whose false-alarm rate is calculated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.structures.damage_threshold import CumulativeSum, threshold_for
from rigwatch.structures.spring_model import SpringModel

FloatArray = NDArray[np.float64]

FLOOR = 1e-4
"""Share of a signal's rms below which its residual is taken for an error of the integration."""
RATE = 0.01
"""Probability of any false alarm in a whole record."""


@dataclass(frozen=True)
class Alarm:
    """The moment at which the residual became too large.

    Attributes:
        sample: at which it was noticed.
        onset: first sample of the surplus that led to it.
    """

    sample: int
    onset: int


@dataclass(frozen=True, eq=False)
class Watch:
    """What watching a record gave.

    Attributes:
        first: the sample that it began with.
        residual: model less observed, shape (samples, m).
        states: of the model, shape (samples, n).
        statistic: cumulative sum, or the largest residual over the limit, shape (samples,).
        threshold: that it is compared with.
        alarm: None where there was none.
    """

    first: int
    residual: FloatArray
    states: FloatArray
    statistic: FloatArray
    threshold: float
    alarm: Alarm | None


@dataclass(frozen=True, eq=False)
class Judge:
    """How residuals are judged.

    Attributes:
        sigma: standard deviation of each signal's residual, shape (m,).
        calibration: undamaged samples that it comes from.
        rate: probability of a false alarm over a whole record.
        limit: fixed limit instead [the signals' units], None for the cumulative sum.
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
        """Run the model beside the record.

        Args:
            model: structure and record.
            parameters: that it has now, shape (n_p,).
            state: at sample `first`, shape (n,).
            first, last: the stretch [samples].
            spread: covariance of the springs' coefficients and the state, shape (c + n, c + n); it
                widens what is expected of the residual.
        """
        run = model.run(parameters, state, first, last)
        residual = run.outputs - model.observed[first:last]
        scale = np.broadcast_to(self.sigma, residual.shape)
        if spread is not None:
            own = np.einsum("kmi,ij,kmj->km", run.slopes, spread, run.slopes)
            scale = np.sqrt(scale**2 + np.maximum(own, 0.0))
        statistic, threshold, alarm = self.judge(residual, scale, first)
        return Watch(first, residual, run.states, statistic, threshold, alarm)

    def judge(
        self, residual: FloatArray, scale: FloatArray, first: int = 0
    ) -> tuple[FloatArray, float, Alarm | None]:
        """Statistic (samples,), threshold and the first alarm of residuals (samples, m)."""
        if self.limit is not None:
            return _by_limit(residual, self.limit, first)
        samples, signals = residual.shape
        threshold = threshold_for(self.rate, signals, _rounded(samples), self.calibration)
        adding = CumulativeSum(signals, threshold)
        statistic, alarm = np.zeros(samples), None
        for k in range(samples):
            if adding.update(residual[k] / scale[k]) and alarm is None:
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


def _rounded(samples: int) -> int:
    """Up to the next of a few lengths, so that few thresholds have to be computed."""
    return int(100 * np.ceil(samples / 100))


def noise(residual: FloatArray, observed: FloatArray) -> FloatArray:
    """Standard deviation of undamaged residuals, not below the integration's errors, shape (m,)."""
    size = np.sqrt(np.nanmean(observed**2, axis=0))
    found = np.sqrt(np.nanmean(residual**2, axis=0))
    return np.asarray(np.maximum(np.nan_to_num(found), FLOOR * np.nan_to_num(size)) + 1e-300)
