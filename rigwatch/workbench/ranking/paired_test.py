"""Whether errors of two models on the same samples differ by more than chance: paired sign test.

Samples are cut into blocks just longer than the correlation time of the difference, so that an
effect visible in one short transient still spans many blocks. Under the null hypothesis each
block's difference is equally likely to have either sign (R. A. Fisher, The Design of Experiments,
1935, 21):

    p = P(Σ ±d_b ≥ Σ d_b)

This makes no assumption about the distribution of block sizes. One large block among small ones
does not mask the others, as it does in a test that divides by the standard deviation.
"""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.stats import norm

from rigwatch.physics.engine.fit import Fit
from rigwatch.physics.engine.score import autocorrelation, correlation_time
from rigwatch.wire.arrays import FloatArray

BLOCK_LENGTH = 2.0
"""Block length over the correlation time."""
MIN_BLOCKS = 8
"""Minimum number of blocks; fewer cannot reach significance."""
ENUMERATED = 12
"""Number of blocks up to which all sign combinations are enumerated; beyond, the sum is nearly
normal."""


@dataclass(frozen=True)
class Difference:
    """Fall of the mean squared error from one model to another.

    Attributes:
        mean: over the samples valid in both.
        relative: relative fall of the rms error there.
        p_falls, p_rises: one-sided p-values of a fall and of a rise this large by chance.
    """

    mean: float
    relative: float
    p_falls: float
    p_rises: float


def difference(before: Fit, after: Fit) -> Difference:
    """Difference of the squared errors of two fits on the same recordings."""
    one, other = _scaled_residuals(before, after)
    squares = np.sum(one**2, axis=1), np.sum(other**2, axis=1)
    fall = squares[0] - squares[1]
    length = int(
        np.clip(
            np.ceil(BLOCK_LENGTH * _correlation_time(one, other)), 1, max(len(one) // MIN_BLOCKS, 1)
        )
    )
    blocks = np.add.reduceat(fall, np.arange(0, len(fall), length))
    falls, rises = _p_value(blocks), _p_value(-blocks)
    total = [float(np.sum(each)) for each in squares]
    relative = 1 - float(np.sqrt(total[1] / max(total[0], 1e-300)))
    return Difference(float(fall.mean()), relative, falls, rises)


def _scaled_residuals(before: Fit, after: Fit) -> tuple[FloatArray, FloatArray]:
    """Scaled residuals at the samples valid in both, each of shape (samples, outputs)."""
    outputs = len(before.scale)
    scale = before.scale if outputs > 1 else np.ones(1)
    one, other = (fit.residuals.reshape(-1, outputs) / scale for fit in (before, after))
    known = np.isfinite(one) & np.isfinite(other)
    rows = known.any(axis=1)
    return np.where(known, one, 0.0)[rows], np.where(known, other, 0.0)[rows]


def _correlation_time(one: FloatArray, other: FloatArray) -> float:
    """Correlation time [samples] of the product of residual and model difference.

    The part of the residual proportional to the model difference is removed first.
    """
    apart = one - other
    share = np.sum(one * apart) / max(float(np.sum(apart**2)), 1e-300)
    product_ = np.sum((one - share * apart) * apart, axis=1)
    return correlation_time(autocorrelation(product_, max(len(product_) // MIN_BLOCKS, 1)))


def _p_value(blocks: FloatArray) -> float:
    """Share of all sign combinations whose sum is at least that of the blocks."""
    total, size = float(np.sum(blocks)), math.hypot(*blocks)
    if size == 0:
        return 1.0
    if len(blocks) > ENUMERATED:
        return float(norm.sf(total / size))
    signs = np.array(list(product((1.0, -1.0), repeat=len(blocks))))
    return float(np.mean(signs @ blocks >= total - 1e-12 * size))
