"""An effect is believed only if it is stronger than it seems to be on the healthy recording.

A model that is not quite the rig sees a little of every effect where nothing is wrong. What an
effect seems to be there, to first order, says how much of it the model's own faults pretend.
"""

from rigwatch.workbench.compare import Bench, apparent_strength
from rigwatch.workbench.explain import Verdict, judge
from rigwatch.workbench.ranking import Ranked

STRONGER = 3.0
"""Strength over that on the healthy recording from which an effect is believed."""


def believed(bench: Bench, rows: list[Ranked]) -> Verdict:
    """The verdict among the effects that are believed; the others are no longer accepted."""
    verdict = judge(bench.base, rows, bench.floor)
    while verdict.best is not None and pretended(bench, verdict.best):
        verdict.best.accepted = False
        verdict.best.reason = "seems nearly as strong where nothing is wrong"
        verdict = judge(bench.base, rows, bench.floor)
    return verdict


def pretended(bench: Bench, row: Ranked) -> bool:
    """Whether the healthy recording shows nearly as much of the effect."""
    healthy = bench.data.of_healthy
    if healthy is None or bench.bare is None or not healthy.along_motion or row.fitted is None:
        return False
    p = row.placement.effect.parameters[row.placement.effect.strength]
    value = row.fitted.train.values()[row.placement.prefix + row.placement.effect.strength]
    seems = apparent_strength(healthy, bench.bare, row.placement, row.fitted)
    return abs(value - p.neutral) < STRONGER * abs(seems)
