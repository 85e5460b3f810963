"""p-values of the score test for autocorrelated residuals and multiple candidates.

A wrong model leaves autocorrelated residuals, and the best of many candidates scores high by
chance; the p-values allow for both.
"""

import numpy as np
from scipy.stats import chi2

from rigwatch.physics.engine.score.autocorrelation import autocorrelation
from rigwatch.physics.engine.score.score_test import Scores, best_of
from rigwatch.wire.arrays import FloatArray


def corrected_p_values(scores: Scores, residual: FloatArray, windows_: int) -> FloatArray:
    """p-values of the scores for autocorrelated residuals, corrected for all candidates.

    The variance of a sum of products of two series exceeds that of white noise by the factor
    Σ_k ρr(k)·ρd(k) (M. S. Bartlett, 1946), where ρ are the autocorrelations of the direction and of
    the residual after removing the candidate.

    Args:
        scores: of the candidates.
        residual: the scaled residual, shape (samples,).
        windows_: number of windows of the samples.
    """
    shape = (windows_, -1, scores.units.shape[1])
    along = scores.units.T @ residual
    left = residual[:, None] - scores.units * along
    own, other = (
        _tapered(left.reshape(shape)),
        _tapered(scores.units.reshape(shape)),
    )
    swollen = np.maximum(1.0, own[0] * other[0] + 2 * np.sum(own[1:] * other[1:], axis=0))
    spread = np.maximum(np.sum(left**2, axis=0), 1e-300) / max(len(residual) - 1, 1)
    alone = chi2.sf(along**2 / (spread * swollen), 1)
    return best_of(alone, int(np.sum(scores.score > 0)))


def _tapered(signals: FloatArray) -> FloatArray:
    """Autocorrelation over windows (windows, samples, k), tapered, up to a quarter of a window."""
    lags = max(min(signals.shape[1] // 4, 200), 1)
    taper = 1 - np.arange(lags) / lags
    return np.asarray(autocorrelation(signals, lags) * taper[:, None])
