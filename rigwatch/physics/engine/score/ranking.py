"""Which candidate explains the residual best: one row a label, with the best of its shapes.

Effects at ports and coefficients of springs are ranked alike; a label names what is ranked, and
candidates that share one differ in their shapes alone. Directions that are nearly parallel once
all that is fitted is taken out of them form a class that the recording cannot tell apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.score.score_test import ALIKE, Scores
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Standing:
    """What one label explains, with the best of its shapes.

    Attributes:
        label: what is ranked.
        index: of its best shape among the candidates.
        score: χ²(1) where it is absent.
        p_value: of the score, corrected for the number of candidates.
        explained: share of the residual's energy.
        strength: first-order estimate.
        turned: cosines with every other label, negative where both explain the residual in
            opposite ways.
    """

    label: str
    index: int
    score: float
    p_value: float
    explained: float
    strength: float
    turned: dict[str, float]

    @property
    def cosines(self) -> dict[str, float]:
        """The same without a sign."""
        return {label: abs(cosine) for label, cosine in self.turned.items()}

    @property
    def alike(self) -> list[str]:
        """Labels of its class, but for its own."""
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
        allowed: whether a candidate's strength makes sense; all of them do if None.
    """
    best = _best_shapes(labels, scores, allowed)
    chosen = list(best.values())
    units, signs = scores.units[:, chosen], np.sign(scores.strength)[chosen]
    turned = (units * signs).T @ (units * signs)
    rows = [
        Standing(
            label, index, float(scores.score[index]), float(p_values[index]),
            float(scores.explained[index]), float(scores.strength[index]),
            {other: float(turned[at, j]) for j, other in enumerate(best) if j != at},
        )
        for at, (label, index) in enumerate(best.items())
    ]  # fmt: skip
    return sorted(rows, key=lambda row: -row.explained)


def _best_shapes(
    labels: Sequence[str], scores: Scores, allowed: Sequence[bool] | None
) -> dict[str, int]:
    """The place of each label's best shape."""
    best: dict[str, int] = {}
    for index, label in enumerate(labels):
        if allowed is not None and not allowed[index]:
            continue
        if label not in best or scores.score[index] > scores.score[best[label]]:
            best[label] = index
    return best


def freed(directions: FloatArray, known: FloatArray) -> FloatArray:
    """Unit directions without what could have been made otherwise.

    Args:
        directions: shape (samples, candidates).
        known: directions of all else that is fitted, shape (samples, n).
    """
    basis = np.linalg.qr(known).Q
    rest = directions - basis @ (basis.T @ directions)
    length = np.linalg.norm(rest, axis=0)
    return np.asarray(rest / np.where(length > 0, length, 1.0))


def cosines_with(units: FloatArray, place: int) -> FloatArray:
    """Absolute cosines of unit directions with that at `place`, at most 1, shape (candidates,)."""
    return np.asarray(np.minimum(np.abs(units.T @ units[:, place]), 1.0))
