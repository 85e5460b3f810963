"""Finds the period of an excitation in samples.

A period is confirmed by the signal itself: the difference between the signal and its copy one
period later must not exceed a tolerance. If many lags are possible, the autocorrelation selects the
candidates.
"""

from collections.abc import Callable, Iterable

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray

FEWEST = 16
"""Minimum number of samples for a search."""
MOST_PERIODS = 8
"""Most periods within a lag of the autocorrelation."""
Allowed = Callable[[FloatArray], float]
"""Allowed mean square difference one lag later, relative to the signal's."""


def shortest_period(signal: FloatArray, lags: Iterable[int], allowed: Allowed) -> int:
    """The first lag after which the signal repeats, 0 if there is none.

    Args:
        signal: shape (n,).
        lags: less than n [samples], shortest first.
        allowed: allowed mean square difference, given the part of the signal after the lag.
    """
    return next((lag for lag in lags if _repeats(signal, lag, allowed)), 0)


def period_by_correlation(signal: FloatArray, allowed: Allowed) -> int:
    """Period of the signal in samples from its autocorrelation, 0 if it does not repeat.

    Args:
        signal: without its mean, shape (n,).
        allowed: as in `shortest_period`.
    """
    for lag in _likely_lags(signal).tolist():
        if _repeats(signal, lag, allowed):
            # Multiples of the period also match: take the shortest.
            parts = (lag // count for count in range(MOST_PERIODS, 0, -1) if lag % count == 0)
            return shortest_period(signal, parts, allowed)
    return 0


def _repeats(signal: FloatArray, lag: int, allowed: Allowed) -> bool:
    later = signal[lag:]
    return bool(np.mean((later - signal[:-lag]) ** 2) <= allowed(later))


def _likely_lags(signal: FloatArray) -> IntArray:
    """The three lags with the highest autocorrelation, after its first fall to one half."""
    n, nothing = len(signal), np.zeros(0, np.int64)
    if n < FEWEST or not np.any(signal):
        return nothing
    spectrum = np.fft.rfft(signal, 2 * n)
    together = np.fft.irfft(spectrum * spectrum.conj())[:n]
    overlap = np.maximum(np.cumsum(signal[::-1] ** 2)[::-1], 1e-300)
    alike = together[: n // 2] / overlap[: n // 2]
    falls = np.flatnonzero(alike < 0.5)
    if not falls.size:
        return nothing
    return np.asarray(falls[0] + np.argsort(-alike[falls[0] :])[:3])
