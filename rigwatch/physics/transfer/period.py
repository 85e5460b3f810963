"""After how many samples an excitation repeats.

A period is confirmed by the signal itself, which must differ from itself a lag later by no more
than is allowed. Where many lags are possible, the autocorrelation says which are worth a try.
"""

from collections.abc import Callable, Iterable

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray

FEWEST = 16
"""Samples in which a period is looked for at least."""
MOST_PERIODS = 8
"""Periods at most that a lag of the autocorrelation may hold."""
Allowed = Callable[[FloatArray], float]
"""Mean square by which a signal may differ from its part that is given, one lag later."""


def shortest_period(signal: FloatArray, lags: Iterable[int], allowed: Allowed) -> int:
    """The first of the lags after which the signal repeats, 0 where it does after none.

    Args:
        signal: shape (n,).
        lags: below n, in samples, the shortest first.
        allowed: mean square of the difference, for the part of the signal from the lag on.
    """
    return next((lag for lag in lags if _repeats(signal, lag, allowed)), 0)


def period_by_correlation(signal: FloatArray, allowed: Allowed) -> int:
    """Samples after which the signal repeats by its autocorrelation, 0 where it does not.

    Args:
        signal: without its mean, shape (n,).
        allowed: as of `shortest_period`.
    """
    for lag in _likely_lags(signal).tolist():
        if _repeats(signal, lag, allowed):
            # Two periods are alike, too: the shortest counts.
            parts = (lag // count for count in range(MOST_PERIODS, 0, -1) if lag % count == 0)
            return shortest_period(signal, parts, allowed)
    return 0


def _repeats(signal: FloatArray, lag: int, allowed: Allowed) -> bool:
    later = signal[lag:]
    return bool(np.mean((later - signal[:-lag]) ** 2) <= allowed(later))


def _likely_lags(signal: FloatArray) -> IntArray:
    """The three lags of highest autocorrelation, beyond where it has fallen to a half."""
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
