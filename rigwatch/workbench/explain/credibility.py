"""An effect is credible only if it is clearly stronger than its apparent strength when healthy.

Model error mimics a little of every effect on a healthy recording. The apparent strength of an
effect there, to first order, is the part that model error can account for.
"""

from rigwatch.workbench.compare import Bench, apparent_strength
from rigwatch.workbench.explain.verdict import Verdict, judge
from rigwatch.workbench.ranking import Ranked

STRONGER = 3.0
"""Smallest ratio of an effect's strength to its apparent strength on the healthy recording."""


def credible_verdict(bench: Bench, rows: list[Ranked]) -> Verdict:
    """The verdict among the credible effects; the others are no longer accepted."""
    verdict = judge(bench.base, rows, bench.floor)
    while verdict.best is not None and apparent_when_healthy(bench, verdict.best):
        verdict.best.accepted = False
        verdict.best.reason = "nearly as strong on the healthy recording"
        verdict = judge(bench.base, rows, bench.floor)
    return verdict


def apparent_when_healthy(bench: Bench, row: Ranked) -> bool:
    """Whether the effect appears nearly as strong on the healthy recording."""
    healthy = bench.data.of_healthy
    if healthy is None or bench.bare is None or not healthy.along_motion or row.fitted is None:
        return False
    p = row.placement.effect.parameters[row.placement.effect.strength]
    value = row.fitted.train.values()[row.placement.prefix + row.placement.effect.strength]
    seems = apparent_strength(healthy, bench.bare, row.placement, row.fitted)
    return abs(value - p.neutral) < STRONGER * abs(seems)
