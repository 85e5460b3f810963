"""Projects the influence of the windows' initial states out of their errors, to first order.

Let S = Q·R be the derivatives of a window's error by its initial state. An error v is matched best
by the change R⁺Qᵀv of the state; the remainder is v − Q·Qᵀv.
"""

import contextlib
from collections.abc import Sequence

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray

NEGLIGIBLE = 1e-10
"""Singular value, relative to the largest, below which a state counts as unobservable."""


class Tangent:
    """The influence of the windows' initial states on their errors.

    Args:
        slopes: derivatives of the errors by all states, shape (windows, k, states).
        groups: windows and the states that are unknown in them.
    """

    def __init__(self, slopes: FloatArray, groups: Sequence[tuple[IntArray, IntArray]]) -> None:
        self._shape = (slopes.shape[0], slopes.shape[2])
        self._groups = [
            (windows, columns, *_split(slopes[windows][..., columns]))
            for windows, columns in groups
            if len(windows) and len(columns)
        ]

    def solve(self, values: FloatArray) -> FloatArray:
        """Least-squares changes of the states for values (windows, k, r): (…, states, r)."""
        found = np.zeros((*self._shape, values.shape[-1]))
        for windows, columns, basis, inverse in self._groups:
            along = basis.swapaxes(1, 2) @ values[windows]
            found[np.ix_(windows, columns)] = inverse @ along
        return found

    @property
    def rank(self) -> int:
        """Number of states, over all windows, that the samples determine."""
        sizes = (np.linalg.svd(inverse, compute_uv=False) for *_, inverse in self._groups)
        # Inverted, the smallest singular value that counted is the largest.
        return sum(int(np.sum(size > 0.1 * NEGLIGIBLE * size[:, :1])) for size in sizes)

    def without(self, values: FloatArray) -> FloatArray:
        """Values (windows, k, r) minus their projection on the states."""
        left = values.copy()
        for windows, _, basis, _ in self._groups:
            left[windows] -= basis @ (basis.swapaxes(1, 2) @ values[windows])
        return left


def _split(slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Q and the pseudo-inverse of R of each window."""
    basis, triangle = np.linalg.qr(slopes)
    return basis, _inverse(triangle)


def _inverse(triangle: FloatArray) -> FloatArray:
    """The pseudo-inverse; where no state is unobservable the inverse, in a fraction of the time."""
    with contextlib.suppress(np.linalg.LinAlgError), np.errstate(over="ignore"):
        inverse = np.linalg.inv(triangle)
        # The condition is at most the product of the Frobenius norms.
        squares = np.sum(triangle**2, axis=(1, 2)) * np.sum(inverse**2, axis=(1, 2))
        if (squares < NEGLIGIBLE**-2).all():
            return np.asarray(inverse)
    return np.asarray(np.linalg.pinv(triangle, rcond=NEGLIGIBLE))
