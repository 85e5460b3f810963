"""p-values of the score test for autocorrelated residuals and multiple candidates.

A wrong model leaves autocorrelated residuals, and the best of many candidates scores high by
chance; the p-values allow for both. A sum of products of two series has the variance

    V = Σ_f Σ_oo' Sr(f, o, o')·Sd(f, o, o')*

with the spectra over outputs o of the direction d and of the residual r after removing the
candidate (M. S. Bartlett, 1946, in the frequency domain). A recording of a few correlation times
tells V from few frequencies only: ν = 2·(Σ_f V_f)² / Σ_f V_f² of them (F. E. Satterthwaite, 1946),
so that score²/V follows F(1, ν), whose tail is far heavier than that of χ²(1). Of the residual's
energy near the direction's frequencies everything fitted has taken its part, which V allows for.
"""

import numpy as np
from scipy.stats import f as f_distribution

from rigwatch.physics.engine.score.score_test import Scores, best_of
from rigwatch.wire.arrays import FloatArray

LAGS = 0.5
"""Share of a window up to which residuals count as correlated; the last half is tapered."""
MOST_LAGS = 400
LEAST_KEPT = 0.1
"""Least share of the residual's energy near a direction that counts as left by what is fitted."""


def corrected_p_values(scores: Scores, residual: FloatArray, outputs: int) -> FloatArray:
    """p-values of the scores for autocorrelated residuals, corrected for all candidates.

    Args:
        scores: of the candidates.
        residual: the scaled residual, shape (samples · outputs,).
        outputs: number of outputs, the fastest index of the residual.
    """
    windows_, samples, columns = scores.fitted.shape
    taken = _spectrum(scores.fitted.reshape(windows_, samples // outputs, outputs, columns))
    shape = (windows_, samples // outputs, outputs, 1)
    alone = [_alone(residual, unit, taken, shape) for unit in scores.units.T]
    return best_of(np.array(alone), int(np.sum(scores.score > 0)))


def _alone(
    residual: FloatArray, unit: FloatArray, taken: FloatArray, shape: tuple[int, int, int, int]
) -> float:
    """p-value of one candidate's score; `taken` is the spectrum of everything fitted."""
    along = float(unit @ residual)
    left = residual - unit * along
    white = max(float(left @ left), 1e-300) / max(len(left) - 1, 1)
    own, other = (_spectrum(signal.reshape(shape)) for signal in (left, unit))
    at_frequency = _product(own, other)
    kept = max(1 - _both_signs(_product(taken + other, other)), LEAST_KEPT)
    variance = max(_both_signs(at_frequency) / kept, white)
    squares = max(float(np.sum(at_frequency**2)), 1e-300)
    # Each frequency is two numbers, and the padding counts it twice.
    told = shape[0] * float(at_frequency.sum()) ** 2 / squares
    freedom = np.clip(kept * told, 1.0, len(left))
    return float(f_distribution.sf(along**2 / variance, 1, freedom))


def _product(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("fab,fab->f", one, other.conj()).real)


def _both_signs(at_frequency: FloatArray) -> float:
    """Sum over positive and negative frequencies."""
    return float(2 * at_frequency.sum() - at_frequency[0] - at_frequency[-1])


def _spectrum(signals: FloatArray) -> FloatArray:
    """Smoothed cross-spectrum of columns, summed over windows and columns.

    Args:
        signals: shape (windows, samples, outputs, columns).

    Returns:
        Shape (frequencies, outputs, outputs), complex, scaled so that the sum of a product over
        both signs is V above.
    """
    windows, samples = signals.shape[:2]
    raw = np.fft.rfft(signals, 2 * samples, axis=1)
    correlation = np.fft.irfft(np.einsum("wfac,wfbc->fab", raw, raw.conj()), axis=0)
    lags = max(min(int(LAGS * samples), MOST_LAGS), 1)
    distance = np.minimum(np.arange(2 * samples), 2 * samples - np.arange(2 * samples))
    taper = np.clip(2 * (1 - distance / lags), 0.0, 1.0)[:, None, None]
    scale = np.sqrt(2 * windows) * samples
    return np.asarray(np.fft.rfft(correlation * taper, axis=0) / scale)
