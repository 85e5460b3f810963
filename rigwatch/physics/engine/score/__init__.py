"""Which effect is missing, to first order: the score test of candidates along a fitted model.

`candidates` lists effects at compatible ports, `effect_sensitivities` computes their influence on
the outputs along a `trajectory`, `finite_effects` what one of finite size adds there, `score_test`
the share of the residual that each explains, `significance` corrects for the number of candidates,
`ranking` selects the best shapes and forms classes of similar effects.
"""

from rigwatch.physics.engine.score.autocorrelation import (
    autocorrelation,
    correlation_time,
    first_below,
)
from rigwatch.physics.engine.score.candidates import (
    Candidate,
    candidates,
    root_mean_square,
    shaped,
    sizes_at_port,
)
from rigwatch.physics.engine.score.compatibility import (
    has_variables,
    possible,
    suits,
    variables_read,
)
from rigwatch.physics.engine.score.effect_sensitivities import directions
from rigwatch.physics.engine.score.finite_effects import finite_effect
from rigwatch.physics.engine.score.ranking import Standing, cosines_with, freed, standings
from rigwatch.physics.engine.score.score_test import (
    ALIKE,
    Projector,
    Scores,
    alone,
    best_of,
    score,
)
from rigwatch.physics.engine.score.significance import corrected_p_values
from rigwatch.physics.engine.score.trajectory import Trajectory, trajectory

__all__ = [
    "ALIKE",
    "Candidate",
    "Projector",
    "Scores",
    "Standing",
    "Trajectory",
    "alone",
    "autocorrelation",
    "best_of",
    "candidates",
    "corrected_p_values",
    "correlation_time",
    "cosines_with",
    "directions",
    "finite_effect",
    "first_below",
    "freed",
    "has_variables",
    "possible",
    "root_mean_square",
    "score",
    "shaped",
    "sizes_at_port",
    "standings",
    "suits",
    "trajectory",
    "variables_read",
]
