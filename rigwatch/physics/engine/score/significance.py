"""p-values of the score test for coloured noise and multiple candidates.

A wrong model leaves correlated residuals, sensors have noise of any colour, and the best of many
candidates scores high by chance; the p-values allow for all three. Along a unit direction u with
the spectrum U the noise varies by

    variance = Σ_b s_b·∫_b |U|²

with its densities s in frequency bands, separately for each output. They are estimated from what
the candidate leaves of the residual (`noise_spectrum.py`).
"""

import numpy as np
from scipy.special import chdtrc

from rigwatch.physics.engine.score.noise_spectrum import NoiseBands, noise_bands, spectra
from rigwatch.physics.engine.score.score_test import Scores, best_of
from rigwatch.wire.arrays import ComplexArray, FloatArray

TOGETHER = 32
"""Candidates treated at once, which bounds the memory."""


def corrected_p_values(scores: Scores, residual: FloatArray) -> FloatArray:
    """p-values of the scores for noise of any colour, corrected for all candidates.

    Args:
        scores: of the candidates.
        residual: scaled, shape (windows, samples, outputs); NaN where nothing was measured.
    """
    outputs = residual.shape[2]
    counted = np.isfinite(residual).reshape(-1, outputs)

    def project(signals: FloatArray) -> FloatArray:
        windowed = signals.reshape(scores.fitted.windows, -1, signals.shape[2])
        return scores.fitted.clean(windowed).reshape(signals.shape)

    bands = noise_bands(project, counted)
    flat = np.where(counted, residual.reshape(-1, outputs), 0.0)
    along, own = scores.units.T @ flat.ravel(), spectra(flat)[..., None]
    units, variance = scores.units.reshape(*flat.shape, -1), np.empty(len(along))
    for at in range(0, len(along), TOGETHER):
        some = slice(at, at + TOGETHER)
        variance[some] = _variances(bands, own, spectra(units[..., some]), along[some])
    alone = chdtrc(1, along**2 / np.maximum(variance, 1e-300))
    return best_of(alone, int(np.sum(scores.score > 0)))


def _variances(
    bands: NoiseBands, residual: ComplexArray, units: ComplexArray, along: FloatArray
) -> FloatArray:
    """Variances of the noise along unit directions, shape (candidates,).

    Args:
        bands: of the recording.
        residual: its spectra, shape (frequencies, outputs, 1).
        units: spectra of the directions, shape (frequencies, outputs, candidates).
        along: the residual along the directions, shape (candidates,).
    """
    shares = bands.energies(np.abs(units) ** 2)
    left = bands.energies(np.abs(residual - along * units) ** 2)
    return np.asarray(np.sum(bands.densities(left, shares) * shares, axis=(0, 1)))
