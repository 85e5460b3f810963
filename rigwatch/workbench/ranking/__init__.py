"""Ranks every effect at every port: score test, refit of the best, held-out error, classes.

`candidates` are scored (`scoring`) and become rows (`ranked`); those `worth_a_fit` are fitted
(`refitting`) and judged by the held-out error (`acceptance`). `rank` runs all of these.
"""

from rigwatch.workbench.ranking.acceptance import EXPLAINED, MATERIAL, STEP, judge_fit, left_over
from rigwatch.workbench.ranking.candidates import candidates, shapes_of
from rigwatch.workbench.ranking.paired_test import difference
from rigwatch.workbench.ranking.rank import rank
from rigwatch.workbench.ranking.ranked import SAME, SIMILAR, Ranked, accepted_from
from rigwatch.workbench.ranking.refitting import Progress, refit, unheard
from rigwatch.workbench.ranking.scoring import rank_all, rank_only, score_all, scored
from rigwatch.workbench.ranking.worth_a_fit import worth_a_fit

__all__ = [
    "EXPLAINED",
    "MATERIAL",
    "SAME",
    "SIMILAR",
    "STEP",
    "Progress",
    "Ranked",
    "accepted_from",
    "candidates",
    "difference",
    "judge_fit",
    "left_over",
    "rank",
    "rank_all",
    "rank_only",
    "refit",
    "score_all",
    "scored",
    "shapes_of",
    "unheard",
    "worth_a_fit",
]
