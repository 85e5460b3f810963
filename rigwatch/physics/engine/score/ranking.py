"""Ranks candidates by the residual that they explain: one row per label, with its best shape.

Effects at ports and coefficients of springs are ranked in the same way; candidates with the same
label differ only in shape. Candidates whose directions are nearly parallel after projecting out the
fitted parameters form a class that the recording cannot distinguish.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.score.score_test import ALIKE, Scores
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Standing:
    """Result of one label with its best shape.

    Attributes:
        label: name of the candidate.
        index: of its best shape among the candidates.
        score: χ²(1) distributed if the effect is absent.
        p_value: of the score, corrected for the number of candidates.
        explained: share of the residual's energy.
        strength: first-order estimate.
        signed_cosines: cosine with every other label: negative if the two explain the residual
            with opposite signs.
    """

    label: str
    index: int
    score: float
    p_value: float
    explained: float
    strength: float
    signed_cosines: dict[str, float]

    @property
    def cosines(self) -> dict[str, float]:
        """Absolute cosines with every other label."""
        return {label: abs(cosine) for label, cosine in self.signed_cosines.items()}

    @property
    def alike(self) -> list[str]:
        """Labels of its class, without its own."""
        return [label for label, cosine in self.cosines.items() if cosine > ALIKE]


def standings(
    labels: Sequence[str],
    scores: Scores,
    p_values: FloatArray,
    allowed: Sequence[bool] | None = None,
) -> list[Standing]:
    """Every label with its best shape, those that explain most first.

    Args:
        labels: of the candidates.
        scores: of the candidates.
        p_values: of the scores, corrected for the number of candidates, shape (candidates,).
        allowed: whether each candidate's strength is valid; all are if None.
    """
    best = _best_shapes(labels, scores, allowed)
    chosen = list(best.values())
    units, signs = scores.units[:, chosen], np.sign(scores.strength)[chosen]
    signed_cosines = (units * signs).T @ (units * signs)
    rows = [
        Standing(
            label, index, float(scores.score[index]), float(p_values[index]),
            float(scores.explained[index]), float(scores.strength[index]),
            {other: float(signed_cosines[at, j]) for j, other in enumerate(best) if j != at},
        )
        for at, (label, index) in enumerate(best.items())
    ]  # fmt: skip
    return sorted(rows, key=lambda row: -row.explained)


def _best_shapes(
    labels: Sequence[str], scores: Scores, allowed: Sequence[bool] | None
) -> dict[str, int]:
    """The index of each label's best shape."""
    best: dict[str, int] = {}
    for index, label in enumerate(labels):
        if allowed is not None and not allowed[index]:
            continue
        if label not in best or scores.score[index] > scores.score[best[label]]:
            best[label] = index
    return best


def freed(directions: FloatArray, known: FloatArray) -> FloatArray:
    """Unit directions with the fitted directions projected out.

    Args:
        directions: shape (samples, candidates).
        known: directions of everything already fitted, shape (samples, n).
    """
    basis = np.linalg.qr(known).Q
    rest = directions - basis @ (basis.T @ directions)
    length = np.linalg.norm(rest, axis=0)
    return np.asarray(rest / np.where(length > 0, length, 1.0))


def cosines_with(units: FloatArray, place: int) -> FloatArray:
    """Absolute cosines of unit directions with the one at `place`, shape (candidates,)."""
    return np.asarray(np.minimum(np.abs(units.T @ units[:, place]), 1.0))
