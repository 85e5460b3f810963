"""Score test of candidates: which effect explains the residual, and which are indistinguishable.

With scaled residuals r and a candidate's direction d, both projected off the column space of the
sensitivities J of everything already fitted (parameters and initial states),

    strength ≈ d·r / d·d,    score = (d·r)² / (d·d · s²)  ~ χ²(1) if the effect is absent

(C. R. Rao, 1948). The best of K candidates is compared with the best of K by chance (Z. Šidák,
1967). Candidates whose projected directions are nearly parallel cannot be distinguished by this
recording and form a class.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from rigwatch.wire.arrays import FloatArray

ALIKE = 0.95
"""Cosine above which two candidates belong to one class."""


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores, one entry per candidate.

    Attributes:
        score: shape (k,); 0 if the direction lies in the space already fitted.
        p_value: of a single candidate, shape (k,).
        corrected: for the best of all candidates, shape (k,).
        strength: first-order estimate, shape (k,).
        explained: share of the residual's energy, shape (k,).
        cosines: between projected directions, absolute, shape (k, k).
        units: the projected directions, of unit length, shape (windows·samples, k).
        fitted: the projector of everything already fitted.
    """

    score: FloatArray
    p_value: FloatArray
    corrected: FloatArray
    strength: FloatArray
    explained: FloatArray
    cosines: FloatArray
    units: FloatArray
    fitted: "Projector"


class Projector:
    """Projects the fitted parameters and initial states out of signals.

    Args:
        by_parameter: scaled sensitivities by parameters, shape (windows, k, m).
        by_start: sensitivities by each window's own initial states, shape (windows, k, n).

    Attributes:
        windows: their number.
    """

    def __init__(self, by_parameter: FloatArray, by_start: FloatArray) -> None:
        self.windows = len(by_start)
        self._starts = np.linalg.qr(by_start).Q
        clean = self._without_starts(by_parameter)
        self._parameters = np.linalg.qr(np.concatenate(clean)).Q

    def _without_starts(self, signals: FloatArray) -> FloatArray:
        along = np.einsum("wki,wkc->wic", self._starts, signals)
        return np.asarray(signals - np.einsum("wki,wic->wkc", self._starts, along))

    def clean(self, signals: FloatArray) -> FloatArray:
        """Projected `signals` (windows, k, c), windows stacked: shape (windows·k, c)."""
        flat = self._without_starts(signals).reshape(-1, signals.shape[-1])
        return np.asarray(flat - self._parameters @ (self._parameters.T @ flat))


def best_of(single: FloatArray, count: int) -> FloatArray:
    """p-values of the best of `count` candidates from their single p-values (Šidák)."""
    return np.asarray(-np.expm1(max(count, 1) * np.log1p(-np.minimum(single, 1 - 1e-16))))


def alone(best: float, count: int) -> float:
    """p-value of a single candidate from that of the best of `count` candidates."""
    return float(-np.expm1(np.log1p(-min(best, 1 - 1e-16)) / max(count, 1)))


def score(
    residuals: FloatArray, candidates: FloatArray, fitted: Projector, variance: float
) -> Scores:
    """Scores of candidates against the residual of a fit.

    Args:
        residuals: scaled, shape (windows, k).
        candidates: scaled directions, shape (windows, k, candidates).
        fitted: projector of everything already fitted.
        variance: of the scaled residuals if nothing is missing (of the noise floor).
    """
    left, r = fitted.clean(candidates), fitted.clean(residuals[..., None])[:, 0]
    energy = np.einsum("kc,kc->c", left, left)
    seen = energy > 1e-10 * np.einsum("wkc,wkc->c", candidates, candidates)
    size = np.sqrt(np.where(seen, energy, 1.0))
    unit = np.where(seen, left / size, 0.0)
    along = unit.T @ r
    single = chdtrc(1, along**2 / variance)
    return Scores(
        along**2 / variance,
        single,
        best_of(single, int(seen.sum())),
        along / size,
        along**2 / max(float(r @ r), 1e-300),
        np.abs(unit.T @ unit),
        unit,
        fitted,
    )
