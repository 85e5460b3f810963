"""Ranks every effect at every port: score test, refit of the best, held-out error, classes."""

from rigwatch.workbench.ranking.rank import (
    EXPLAINED,
    SAME,
    SIMILAR,
    Progress,
    Ranked,
    accepted_from,
    candidates,
    judge_fit,
    left_over,
    rank,
    rank_all,
    rank_only,
    refit,
    score_all,
    unheard,
)

__all__ = [
    "EXPLAINED",
    "SAME",
    "SIMILAR",
    "Progress",
    "Ranked",
    "accepted_from",
    "candidates",
    "judge_fit",
    "left_over",
    "rank",
    "rank_all",
    "rank_only",
    "refit",
    "score_all",
    "unheard",
]
