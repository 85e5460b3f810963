"""Autocorrelation of signals, 1 at lag zero."""

import numpy as np

from rigwatch.wire.arrays import FloatArray

UNCORRELATED = 0.1
"""Autocorrelation below which samples count as uncorrelated."""


def autocorrelation(signals: FloatArray, lags: int) -> FloatArray:
    """Autocorrelation at lags 0 to `lags` - 1, averaged over windows; not tapered, mean kept.

    Args:
        signals: shape (samples,) or (windows, samples, k).
        lags: at most the number of samples.

    Returns:
        shape (lags,) or (lags, k).
    """
    windows = signals[None, :, None] if signals.ndim == 1 else signals
    spectrum = np.fft.rfft(windows, 2 * windows.shape[1], axis=1)
    together = np.fft.irfft(np.mean(np.abs(spectrum) ** 2, axis=0), axis=0)[:lags]
    found = together / np.where(together[0] > 0, together[0], 1.0)
    return np.asarray(found[:, 0] if signals.ndim == 1 else found)


def correlation_time(correlation: FloatArray) -> float:
    """Time over which a series is correlated, from its autocorrelation (lags,) [samples].

    The lags count up to the first at which it is below `UNCORRELATED`.
    """
    last = first_below(correlation, UNCORRELATED)
    return float(1 + 2 * np.sum(correlation[1:last]))


def first_below(correlation: FloatArray, level: float) -> int:
    """The first lag at which an autocorrelation is below `level`, else their number [samples]."""
    below = np.nonzero(correlation < level)[0]
    return int(below[0]) if len(below) else len(correlation)
