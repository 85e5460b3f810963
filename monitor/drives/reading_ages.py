"""Assumptions on which readings of a window are a step old, and how well a smooth curve fits."""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

DEGREE = 3
"""Of the polynomials that represent the smooth curve."""


class Ages(NamedTuple):
    """Every assumption on which readings of a window are old.

    Attributes:
        old: 1 for an old reading, shape (assumptions, 2·half); the first has none.
        changes: how often old and new change, shape (assumptions,).
        misfits: projections onto what no curve fits, (assumptions, 2·half - DEGREE - 1, 2·half).
        values: weights of the readings in the voltage in force in the middle, shape as `old`.
    """

    old: NDArray[np.int64]
    changes: NDArray[np.int64]
    misfits: FloatArray
    values: FloatArray


def assumptions(half: int) -> Ages:
    """All assumptions for a window of 2·half readings."""
    size = 2 * half
    old = (np.arange(2**size)[:, None] >> np.arange(size)) & 1
    shapes = [_shape(each, half) for each in old]
    misfits, values = (np.ascontiguousarray(np.stack(part)) for part in zip(*shapes, strict=True))
    return Ages(old, np.abs(np.diff(old, axis=1)).sum(axis=1), misfits, values)


def _shape(old: NDArray[np.int64], half: int) -> tuple[FloatArray, FloatArray]:
    """Projection and weights for one assumption."""
    powers = np.vander((np.arange(old.size) - old) / half - 1.0, DEGREE + 1)
    rotated, _ = np.linalg.qr(powers, mode="complete")
    weights = np.vander([-1.0 / half], DEGREE + 1) @ np.linalg.pinv(powers)
    return rotated[:, DEGREE + 1 :].T, weights[0]


@part()
def misfit(projection: FloatArray, window: FloatArray) -> float:
    """Energy of a window that no curve fits, under an assumption."""
    total = 0.0
    for i in range(projection.shape[0]):
        left = 0.0
        for j in range(window.size):
            left += projection[i, j] * window[j]
        total += left * left
    return total
