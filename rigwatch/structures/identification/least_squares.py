"""Linear least squares with weights, gaps, noise per signal, and a test of determinacy.

Rows are samples of signals, columns unknowns. Columns are scaled to equal length before the
decomposition, so that stiffnesses of 1000 N/m and masses of 1 g are treated alike.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

FOUR_DIGITS = 1e-4
"""Smallest plausible error of a signal, as a share of its rms, regardless of the fit."""
BLIND = 1e-9
"""Share of the largest singular value below which a combination of unknowns is undetermined."""


@dataclass(frozen=True, eq=False)
class Step:
    """The solution of one linear problem.

    Attributes:
        change: change of the unknowns, shape (m,).
        covariance: from the remaining residuals, shape (m, m).
        blind: which unknowns are part of an undetermined combination, shape (m,).
    """

    change: FloatArray
    covariance: FloatArray
    blind: NDArray[np.bool_]


def solve(
    errors: FloatArray,
    slopes: FloatArray,
    weight: FloatArray,
    scale: FloatArray,
    *,
    least_variance: float = 0.0,
) -> Step:
    """The change of the unknowns that minimises the errors: errors ≈ slopes·change.

    Args:
        errors: measured minus predicted, shape (samples, outputs), NaN where not measured.
        slopes: shape (samples, outputs, m).
        weight: weight of each squared sample, shape (samples,).
        scale: expected standard deviation of each output, shape (outputs,).
        least_variance: lower bound of the scaled errors' variance in the covariance.
    """
    factor = np.sqrt(weight)[:, None] / scale
    use = np.isfinite(errors) & (factor > 0)
    rows = slopes[use] * factor[use][:, None]
    right = errors[use] * factor[use]
    length = np.linalg.norm(rows, axis=0)
    length = np.where(length > 0, length, 1.0)
    left, sizes, across = np.linalg.svd(rows / length, full_matrices=False)
    seen = sizes > BLIND * sizes[0]
    along = np.where(seen, left.T @ right / np.where(seen, sizes, 1.0), 0.0)
    change = across.T @ along / length
    rest = right - rows @ change
    half = across.T * (np.where(seen, 1.0 / np.where(seen, sizes, 1.0), 0.0))
    variance = max(float(rest @ rest) / max(len(right) - len(length), 1), least_variance)
    covariance = variance * (half @ half.T) / np.outer(length, length)
    blind = np.abs(across[~seen]).max(axis=0, initial=0.0) > 0.05
    return Step(change, covariance, blind)


def require_determined(names: tuple[str, ...], blind: NDArray[np.bool_], where: str) -> None:
    """Refuse more unknowns than the record determines.

    Raises:
        ModelError: some unknowns are undetermined; they are named.
    """
    if blind.any():
        found = ", ".join(name for name, flag in zip(names, blind, strict=True) if flag)
        raise ModelError(
            f"{where}: found {len(names)} unknowns of which this record does not determine"
            f" {found}, expected fewer unknowns, more signals or another excitation"
        )
