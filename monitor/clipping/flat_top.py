"""Clipping inside the range: a channel whose peaks are cut off at one and the same value.

A real reading carries noise, so it rarely repeats exactly; a clipped one repeats as long
as the signal would exceed it. Every reading at the extreme of the last one to two spans is a trial:
does the next one repeat it? With p the largest probability that noise allows and q = (1 + p)/2,
Page's cumulative sum, one for each end of each channel,

    S ← max(0, S + ln(q/p))            repeated
    S ← max(0, S + ln((1-q)/(1-p)))    not repeated

exceeds h in a healthy channel after at least e^h trials on average (Lorden, Annals of Mathematical
Statistics 42, 1971). The h is that of every other threshold: e^-h is the probability allowed per
test. It needs no amplitude, range, period or model. If the converter's step hides the noise, p is
near 1 and nothing is reported. Repeats count once the signal leaves the extreme: a channel that
stays there, as one that sticks at a peak, does not move at all and is stuck, not clipped.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.signals import copy_rows, fill_rows
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

SPAN = 256
"""Samples. Extremes are those of the running span and of the one before it, so that a peak from
before the fault is forgotten, and motion down to a hertz comes to its own extremes.
"""
NEVER = 1.0
"""Probability of a repeat above which a channel is not judged."""
_CEILING = 2.0
"""Upper bound of S in units of h, so that it falls soon after the clipping ends."""


class FlatTops(NamedTuple):
    """State; the last axis is upper and lower end.

    Args:
        score: S, shape (c, 2).
        waiting: what the repeats of the running flat top add to S, shape (c, 2).
        extreme: largest x and largest -x of the running span and of the one before, (2, c, 2).
        last: newest reading, NaN if it was not good, shape (c,).
        filled: samples in the running span, shape (1,).
        trials, repeats: counted since the start, shape (c, 2).
    """

    score: FloatArray
    waiting: FloatArray
    extreme: FloatArray
    last: FloatArray
    filled: NDArray[np.int64]
    trials: NDArray[np.int64]
    repeats: NDArray[np.int64]


def new_flat_tops(channels: int) -> FlatTops:
    """The initial state."""
    state = FlatTops(
        np.zeros((channels, 2)),
        np.zeros((channels, 2)),
        np.zeros((2, channels, 2)),
        np.zeros(channels),
        np.zeros(1, np.int64),
        np.zeros((channels, 2), np.int64),
        np.zeros((channels, 2), np.int64),
    )
    reset_flat_tops(state)
    return state


@kernel()
def reset_flat_tops(state: FlatTops) -> None:
    """Reset to the initial state; the counts stay."""
    state.score[:, :] = 0.0
    state.waiting[:, :] = 0.0
    state.extreme[:, :, :] = -np.inf
    state.last[:] = np.nan
    state.filled[0] = 0


@kernel()
def judge_flat_tops(  # noqa: PLR0917
    values: FloatArray,
    good: NDArray[np.bool_],
    chance: FloatArray,
    limit: float,
    state: FlatTops,
    score: FloatArray,
) -> None:
    """Process samples; `score` gets the larger S of the two ends, after each sample.

    Args:
        values: readings, shape (n, c); arbitrary where not good.
        good: shape (n, c).
        chance: p of each channel, shape (c,); NEVER if it is not judged.
        limit: h.
        state: carried on.
        score: shape (n, c).
    """
    for k in range(values.shape[0]):
        for c in range(values.shape[1]):
            if good[k, c]:
                for end in range(2):
                    side = values[k, c] if end == 0 else -values[k, c]
                    _trial(side, c, end, chance[c], limit, state)
                state.last[c] = values[k, c]
            else:
                state.last[c] = np.nan
                state.waiting[c, :] = 0.0
            score[k, c] = max(state.score[c, 0], state.score[c, 1])
        state.filled[0] += 1
        if state.filled[0] == SPAN:
            state.filled[0] = 0
            copy_rows(state.extreme[0], state.extreme[1])
            fill_rows(state.extreme[0], -np.inf)


@part()
def _trial(  # noqa: PLR0917
    side: float, c: int, end: int, chance: float, limit: float, state: FlatTops
) -> None:
    """One reading of one channel, for one end of the range: `side` is x or -x."""
    before = state.last[c] if end == 0 else -state.last[c]
    at_extreme = before >= _extreme(state, c, end)
    if at_extreme and before > -_extreme(state, c, 1 - end):
        repeats = side == before
        state.trials[c, end] += 1
        state.repeats[c, end] += 1 if repeats else 0
        if chance < NEVER:
            likely = 0.5 * (1.0 + chance)
            if repeats:
                state.waiting[c, end] += np.log(likely / chance)
            else:
                top = min(state.score[c, end] + state.waiting[c, end], _CEILING * limit)
                state.score[c, end] = max(top + np.log((1 - likely) / (1 - chance)), 0.0)
                state.waiting[c, end] = 0.0
    state.extreme[0, c, end] = max(state.extreme[0, c, end], side)


@part()
def _extreme(state: FlatTops, c: int, end: int) -> float:
    return max(state.extreme[0, c, end], state.extreme[1, c, end])
