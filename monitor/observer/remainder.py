"""The equations' residual on healthy recordings, as a polynomial in motion and hidden states.

The polynomial is smooth and fixed after fitting, so it cannot absorb a later fault. Ridge
regression keeps terms small that the recordings do not determine. What a sensor keeps of its own
signal, as the mean that one coupled by AC takes away, exerts no force: it may drift for minutes,
beyond what any recording has seen, and no term contains it.
"""

from collections.abc import Collection, Sequence

import numpy as np
import scipy

from monitor.model import RemainderSection
from monitor.observer.missing_force import terms
from monitor.observer.remainder_terms import counting_terms, information_of
from rigwatch.wire.arrays import FloatArray

RIDGE = 3e-3
"""Ridge weight of the coefficients relative to the error, both in standard deviations."""


def no_remainder(signals: int) -> RemainderSection:
    """The zero remainder."""
    count = signals + signals * (signals + 1) // 2
    return RemainderSection(centre=(0.0,) * signals, scale=(1.0,) * signals, weights=(0.0,) * count)


def fit_remainder(
    parts: Sequence[tuple[FloatArray, FloatArray]],
    filters: tuple[FloatArray, FloatArray],
    skip: int,
    without: Collection[int],
) -> RemainderSection:
    """The remainder of healthy recordings.

    Args:
        parts: signals, shape (n, signals), and high-passed residual, shape (n,), of each recording.
        filters: of the high-pass.
        skip: number of samples skipped at the start of each.
        without: indices of signals on which it does not depend.
    """
    every = np.concatenate([signals[skip:] for signals, _ in parts])
    centre, scale = every.mean(axis=0), np.maximum(every.std(axis=0), 1e-12)
    used = counting_terms(every.shape[1], without)
    columns = [
        scipy.signal.lfilter(*filters, terms(z, centre, scale)[:, used], axis=0)[skip:]
        for z, _ in parts
    ]
    phi, residual = np.concatenate(columns), np.concatenate([e[skip:] for _, e in parts])
    size = np.maximum(phi.std(axis=0), 1e-12)
    alike = phi / size
    gram = alike.T @ alike + RIDGE * len(phi) * np.eye(phi.shape[1])
    weights = np.zeros(used.size)
    weights[used] = np.linalg.solve(gram, alike.T @ residual) / size
    return RemainderSection(
        centre=tuple(centre.tolist()),
        scale=tuple(scale.tolist()),
        weights=tuple(weights.tolist()),
        information=information_of(phi, residual, residual - phi @ weights[used]),
    )
