"""Whether errors of two models on the same samples differ by more than chance: a paired sign test.

Samples are cut into blocks as long as what is left remembers itself, and no longer, so that an
effect that shows in one short transient alone has many of them. Where there is no difference, that
of each block is as likely to have either sign (R. A. Fisher, The Design of Experiments, 1935, 21):

    p = P(Σ ±d_b ≥ Σ d_b)

asks for no distribution of their sizes, so that one large block among small ones does not hide
what all of them say, as it does in a test that divides by their spread.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.stats import norm

from rigwatch.physics.engine.fit import Fit
from rigwatch.wire.arrays import FloatArray

FORGOTTEN = 0.1
"""Autocorrelation at which what is left has forgotten itself."""
MEMORIES = 2.0
"""Blocks over that memory."""
FEWEST = 8
"""Blocks at least: fewer could not tell anything at all."""
COUNTED = 12
"""Blocks up to which every choice of signs is counted; the sum over more is nearly normal."""


@dataclass(frozen=True)
class Difference:
    """Fall of the mean squared error from one model to another.

    Attributes:
        mean: over the samples that count in both.
        relative: share by which the error falls there.
        p_falls, p_rises: how likely chance alone would do as much, one-sided.
    """

    mean: float
    relative: float
    p_falls: float
    p_rises: float


def difference(before: Fit, after: Fit) -> Difference:
    """How the squared error of `after` differs from that of `before`, of the same recordings."""
    one, other = _counted(before, after)
    squares = np.sum(one**2, axis=1), np.sum(other**2, axis=1)
    fall = squares[0] - squares[1]
    length = int(np.clip(np.ceil(MEMORIES * _memory(one, other)), 1, max(len(one) // FEWEST, 1)))
    blocks = np.add.reduceat(fall, np.arange(0, len(fall), length))
    falls, rises = _chance(blocks), _chance(-blocks)
    total = [float(np.sum(each)) for each in squares]
    relative = 1 - float(np.sqrt(total[1] / max(total[0], 1e-300)))
    return Difference(float(fall.mean()), relative, falls, rises)


def _counted(before: Fit, after: Fit) -> tuple[FloatArray, FloatArray]:
    """Scaled residuals at the samples that count in both, each (samples, outputs)."""
    outputs = len(before.scale)
    scale = before.scale if outputs > 1 else np.ones(1)
    one, other = (fit.residuals.reshape(-1, outputs) / scale for fit in (before, after))
    known = np.isfinite(one) & np.isfinite(other)
    rows = known.any(axis=1)
    return np.where(known, one, 0.0)[rows], np.where(known, other, 0.0)[rows]


def _memory(one: FloatArray, other: FloatArray) -> float:
    """Samples over which what is left is correlated where the two models differ.

    What the difference of the models could make of the error by its size alone is taken out of it.
    """
    apart = one - other
    share = np.sum(one * apart) / max(float(np.sum(apart**2)), 1e-300)
    product_ = np.sum((one - share * apart) * apart, axis=1)
    spectrum = np.abs(np.fft.rfft(product_, 2 * len(product_))) ** 2
    together = np.fft.irfft(spectrum)[: max(len(product_) // FEWEST, 1)]
    correlation = together / max(float(together[0]), 1e-300)
    below = np.nonzero(correlation < FORGOTTEN)[0]
    last = int(below[0]) if len(below) else len(correlation)
    return float(1 + 2 * np.sum(correlation[1:last]))


def _chance(blocks: FloatArray) -> float:
    """Share of all choices of signs whose sum is as large as that of the blocks."""
    total, size = float(np.sum(blocks)), float(np.sqrt(np.sum(blocks**2)))
    if size == 0:
        return 1.0
    if len(blocks) > COUNTED:
        return float(norm.sf(total / size))
    signs = np.array(list(product((1.0, -1.0), repeat=len(blocks))))
    return float(np.mean(signs @ blocks >= total - 1e-12 * size))
