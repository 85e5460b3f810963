"""Which effect is missing, to first order: the score test of candidates along a fitted model.

`effect_sensitivities` computes what each candidate would do, `score_test` how much of the
residual it explains, `significance` corrects for the number of candidates.
"""

from rigwatch.physics.engine.score.compatibility import knows, possible, suits
from rigwatch.physics.engine.score.effect_sensitivities import (
    Candidate,
    directions,
    shaped,
    trajectory,
)
from rigwatch.physics.engine.score.score_test import ALIKE, Projector, Scores, score
from rigwatch.physics.engine.score.significance import corrected_p_values

__all__ = [
    "ALIKE",
    "Candidate",
    "Projector",
    "Scores",
    "corrected_p_values",
    "directions",
    "knows",
    "possible",
    "score",
    "shaped",
    "suits",
    "trajectory",
]
