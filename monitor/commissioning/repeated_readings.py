"""Probability that a healthy reading repeats its predecessor, as needed by `flat_top.py`.

Two readings of the same true value agree at most with probability

    p = erf( Δ / (2√2·σ) ),     σ² = E[(e_k - e_{k-1})²]/2 - Δ²/12,

with Δ the converter's step and e the deviation from the average period. Only changes between
successive samples count as noise, since a slow disturbance does not prevent repeats. A second bound
is the share of repeats in the recording itself, at its upper confidence limit.
"""

import numpy as np
from scipy.special import betaincinv, erf

from monitor.clipping import NEVER, judge_flat_tops, new_flat_tops
from rigwatch.wire.arrays import FloatArray

SURE = 0.999
"""Confidence level of the observed share of repeats."""
_ON_GRID = 0.99
"""Share of readings that must lie on whole steps; otherwise the recording was resampled and gives
no information on repeats of the live channel.
"""


def chance_of_repeat(values: FloatArray, mean: FloatArray) -> float:
    """Largest probability that a healthy reading repeats its predecessor.

    Args:
        values: readings of one channel, whole periods of the excitation, shape (k·P,).
        mean: the average period, shape (P,).

    Returns:
        From 0 to 1; 1 if the channel cannot be judged.
    """
    step = step_of(values)
    if step == 0.0:
        return NEVER
    deviation = values - np.resize(mean, values.size)
    variance = np.mean(np.diff(deviation) ** 2) / 2.0 - step**2 / 12.0
    if variance <= 0.0:
        return NEVER
    allowed = float(erf(step / np.sqrt(8.0 * variance)))
    return min(max(allowed, _seen(values)), NEVER)


def step_of(values: FloatArray) -> float:
    """The converter's step, 0 if the readings are not on a grid."""
    levels = np.unique(values)
    if levels.size < 2:
        return 0.0
    step = float(np.diff(levels).min())
    steps = (values - levels[0]) / step
    off_grid = np.abs(steps - np.round(steps))
    return step if np.mean(off_grid < 0.01) >= _ON_GRID else 0.0


def _seen(values: FloatArray) -> float:
    state, rows = new_flat_tops(1), values[:, None]
    never, score = np.full(1, NEVER), np.zeros(rows.shape)
    judge_flat_tops(rows, np.ones(rows.shape, np.bool_), never, np.inf, state, score)
    bounds = [
        betaincinv(repeats + 1.0, trials - repeats, SURE) if trials > repeats else NEVER
        for trials, repeats in zip(state.trials[0], state.repeats[0], strict=True)
    ]
    return float(max(bounds))
