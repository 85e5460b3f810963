"""Ranks every effect at every port: score test, refit of the best, held-out error, classes.

`candidates` are scored (`scoring`) and become rows (`ranked`); the most promising (`fit_selection`)
are fitted (`refitting`) and judged by the held-out error (`acceptance`). `rank` runs all of these;
`with_refinements` adds effects that describe the best one in more detail.
"""

from rigwatch.workbench.ranking.acceptance import (
    EXPLAINED,
    MATERIAL,
    NEAR,
    STEP,
    judge_fit,
    left_over,
    neutral_strength,
    refutes_neutral,
    vanishes,
    vanishing_shape,
)
from rigwatch.workbench.ranking.candidates import candidates, shapes_of, suitable
from rigwatch.workbench.ranking.fit_selection import select_for_fit
from rigwatch.workbench.ranking.nested_start import refit_nested
from rigwatch.workbench.ranking.paired_test import difference
from rigwatch.workbench.ranking.proportion import denies_gain
from rigwatch.workbench.ranking.rank import AGAIN, MUCH_WORSE, rank
from rigwatch.workbench.ranking.ranked import (
    SAME,
    SIMILAR,
    Ranked,
    accepted_from,
    best_accepted,
    error_ratio,
    in_order,
    lowest,
    same_family,
)
from rigwatch.workbench.ranking.refinements import (
    promises_more,
    refinements,
    with_refinements,
)
from rigwatch.workbench.ranking.refitting import (
    Fitting,
    Progress,
    fit_started,
    leaves_only_noise,
    no_progress,
    own_floor,
    refit,
    refit_from_given,
    values_of_base,
)
from rigwatch.workbench.ranking.same_drive import denied_sensors
from rigwatch.workbench.ranking.scoring import rank_all, rank_only, score_all, scored
from rigwatch.workbench.ranking.series_order import Order, order_of, orders_at_port

__all__ = [
    "AGAIN",
    "EXPLAINED",
    "MATERIAL",
    "MUCH_WORSE",
    "NEAR",
    "SAME",
    "SIMILAR",
    "STEP",
    "Fitting",
    "Order",
    "Progress",
    "Ranked",
    "accepted_from",
    "best_accepted",
    "candidates",
    "denied_sensors",
    "denies_gain",
    "difference",
    "error_ratio",
    "fit_started",
    "in_order",
    "judge_fit",
    "leaves_only_noise",
    "left_over",
    "lowest",
    "neutral_strength",
    "no_progress",
    "order_of",
    "orders_at_port",
    "own_floor",
    "promises_more",
    "rank",
    "rank_all",
    "rank_only",
    "refinements",
    "refit",
    "refit_from_given",
    "refit_nested",
    "refutes_neutral",
    "same_family",
    "score_all",
    "scored",
    "select_for_fit",
    "shapes_of",
    "suitable",
    "values_of_base",
    "vanishes",
    "vanishing_shape",
    "with_refinements",
]
