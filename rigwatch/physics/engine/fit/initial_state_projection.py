"""What the initial states of windows can do to their errors, to first order.

With slopes S of a window's error by its initial state, S = Q·R: a value v of the error is met best
by the change R⁺Qᵀv of the state, and v − Q·Qᵀv of it is left, whatever the state.
"""

from collections.abc import Sequence

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray

NEGLIGIBLE = 1e-10
"""Singular value over the largest below which a state shows in no output."""


class Tangent:
    """The initial states of windows, as directions in their errors.

    Args:
        slopes: of the errors by all states, shape (windows, k, states).
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
        """Changes of the states that come closest to values (windows, k, r): (…, states, r)."""
        found = np.zeros((*self._shape, values.shape[-1]))
        for windows, columns, basis, inverse in self._groups:
            along = basis.swapaxes(1, 2) @ values[windows]
            found[np.ix_(windows, columns)] = inverse @ along
        return found

    def without(self, values: FloatArray) -> FloatArray:
        """Values (windows, k, r) less what the states can make of them."""
        left = values.copy()
        for windows, _, basis, _ in self._groups:
            left[windows] -= basis @ (basis.swapaxes(1, 2) @ values[windows])
        return left


def _split(slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Q, and the pseudo-inverse of R, of each window."""
    basis, triangle = np.linalg.qr(slopes)
    return basis, np.linalg.pinv(triangle, rcond=NEGLIGIBLE)
