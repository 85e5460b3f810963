"""A threshold that grows with the activity of the input (Höfling and Deibert 1994).

A model with a relative error leaves a residual in proportion to its input, larger while the input
changes. A fixed limit is then either exceeded by every manoeuvre or blind at rest. The limit here
is

    J(t) = c + e(t),   e(t) = max( |w(t)|, e(t-1)·exp(-T/T2) ),   w = K·(1 + T1·s)/(1 + T2·s)·u

    u   input, operating point removed [input unit]     K   gain [output unit / input unit]
    c   floor: noise of the residual [output unit]      T1  lead time [s]
    T   sample period [s]                               T2  lag time [s]

The lead-lag filter is discretised exactly for a held input: z += (1 - exp(-T/T2))·(u - z), w = K·(z
+ T1/T2·(u - z)). The envelope e keeps the limit from vanishing at each zero crossing of the input;
it decays as the filter does, so four figures (c, K, T1, T2) suffice, as in the paper.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.kernel import kernel, part

NOISE_FACTOR = 4.0
"""Smallest floor, in standard deviations of the residual's noise [1]."""


@dataclass(frozen=True, slots=True)
class AdaptiveThreshold:
    """The four figures.

    Attributes:
        floor: c [output unit].
        gain: K [output unit / input unit].
        lead: T1 [s].
        lag: T2 [s].

    Raises:
        ModelError: a figure is negative, not finite, or the lag is 0.
    """

    floor: float
    gain: float
    lead: float
    lag: float

    def __post_init__(self) -> None:
        figures = np.array([self.floor, self.gain, self.lead, self.lag])
        if not np.all(np.isfinite(figures)) or np.any(figures < 0.0) or self.lag == 0.0:
            raise ModelError(f"adaptive threshold: found {figures}, expected figures above 0")

    def coefficients(self, sample_rate: float) -> FloatArray:
        """(floor, gain, lead/lag, exp(-T/T2)), the kernel's coefficients."""
        decay = np.exp(-1.0 / (sample_rate * self.lag))
        return np.array([self.floor, self.gain, self.lead / self.lag, decay])


class ThresholdState(NamedTuple):
    """Carried state: lagged input and envelope, shape (2,)."""

    memory: FloatArray


def new_threshold_state() -> ThresholdState:
    """At rest."""
    return ThresholdState(np.zeros(2))


@part()
def threshold_sample(coefficients: FloatArray, state: ThresholdState, u: float) -> float:
    """J(t) for the next input `u`."""
    floor, gain, ratio, decay = coefficients
    memory = state.memory
    memory[0] += (1.0 - decay) * (u - memory[0])
    w = gain * abs(memory[0] + ratio * (u - memory[0]))
    memory[1] = max(w, memory[1] * decay)
    return float(floor + memory[1])


@kernel(allocates=True)
def threshold_block(coefficients: FloatArray, state: ThresholdState, u: FloatArray) -> FloatArray:
    """`threshold_sample` over a block, shape (n,)."""
    limit = np.empty(u.size)
    for k in range(u.size):
        limit[k] = threshold_sample(coefficients, state, u[k])
    return limit


def fit_threshold(
    residual: FloatArray, u: FloatArray, sample_rate: float, slowest: float, margin: float
) -> AdaptiveThreshold:
    """The tightest threshold that leaves a `margin` above a healthy residual.

    Lag and lead are scanned; for each pair the gain is scanned and the floor follows. The lowest
    mean limit wins; of several equals (a steady input cannot separate floor from gain) the largest
    gain wins, since a model's error grows with its input.

    Args:
        residual: healthy, NaN where not judged, shape (n,).
        u: input with the operating point removed, shape (n,).
        sample_rate: [Hz].
        slowest: slowest time constant of the model [s].
        margin: limit over residual, above 1.

    Raises:
        ModelError: there is no healthy residual to fit to.
    """
    judged = np.isfinite(residual)
    if not judged.any():
        raise ModelError("adaptive threshold: found no judged sample in the healthy recording")
    size = margin * np.abs(residual[judged])
    noise = margin * NOISE_FACTOR * noise_deviation(residual[judged])
    best, best_cost = AdaptiveThreshold(float(size.max()), 0.0, 0.0, slowest), float(size.max())
    for lag in slowest * np.array([0.5, 1.0, 2.0]):
        for ratio in (0.5, 1.0, 2.0, 4.0):
            unit = AdaptiveThreshold(0.0, 1.0, float(ratio * lag), float(lag))
            envelope = threshold_block(unit.coefficients(sample_rate), new_threshold_state(), u)
            candidate, cost = _best_gain(size, envelope[judged], unit, noise)
            if cost < 0.98 * best_cost or (cost < 1.02 * best_cost and candidate.gain > best.gain):
                best, best_cost = candidate, min(cost, best_cost)
    return best


def noise_deviation(values: FloatArray) -> float:
    """Standard deviation of white noise under a smooth signal, from its sixth differences."""
    if values.size < 16:
        return 0.0
    gain = float(np.sum(np.array([1, 6, 15, 20, 15, 6, 1]) ** 2))
    return float(np.sqrt(np.mean(np.diff(values, 6) ** 2) / gain))


def _best_gain(
    size: FloatArray, envelope: FloatArray, unit: AdaptiveThreshold, noise: float
) -> tuple[AdaptiveThreshold, float]:
    """Gain and floor, at least `noise`, of the lowest mean limit above `size`."""
    steepest = float(size.max() / max(envelope.max(), 1e-300))
    options = []
    for gain in steepest * np.linspace(0.0, 1.5, 31):
        floor = max(float(np.max(size - gain * envelope)), noise)
        mean_limit = floor + float(gain) * float(envelope.mean())
        options.append((mean_limit, float(gain), floor))
    lowest = min(options)[0]
    mean_limit, gain, floor = max(
        (one for one in options if one[0] <= 1.02 * lowest), key=lambda one: one[1]
    )
    return AdaptiveThreshold(floor, gain, unit.lead, unit.lag), mean_limit
