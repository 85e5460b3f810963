"""How often a healthy reading repeats the one before it: what `flat_top.py` goes by, from a healthy
recording.

Two readings of one and the same true value agree at most with the chance

    p = erf( Δ / (2√2·σ) ),     σ² = E[(e_k - e_{k-1})²]/2 - Δ²/12,

Δ the converter's step and e the deviation from the average period. Only what changes from one
sample to the next counts as noise: a slow disturbance does not keep readings from repeating. The
share of repeats that the recording itself shows, at its upper confidence limit, is a second bound.
"""

import numpy as np
from scipy.special import betaincinv, erf

from monitor.clipping import NEVER, judge_flat_tops, new_flat_tops
from rigwatch.wire.arrays import FloatArray

SURE = 0.999
"""Confidence of the share of repeats that has been seen."""
_ON_GRID = 0.99
"""Share of the readings that must lie on whole steps, or there is no step: the recording was
resampled, and says nothing about repeats of the live channel.
"""


def chance_of_repeat(values: FloatArray, mean: FloatArray) -> float:
    """Largest chance that a healthy reading repeats the one before it.

    Args:
        values: readings of one channel, whole periods of the excitation, shape (k·P,).
        mean: the average period, shape (P,).

    Returns:
        From 0 to 1; 1 where the channel cannot be judged.
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
    """The converter's step, 0 where the readings lie on no grid."""
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
