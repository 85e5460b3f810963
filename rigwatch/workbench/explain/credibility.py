"""When an effect is not credible: it shows on a healthy recording, or another law fits far better.

Model error mimics a little of every effect on a healthy recording. The apparent strength of an
effect there, to first order, is the part that model error can account for.

What is missing may not be in the library. Then the most similar effect lowers the error in its
place, often by most of it. A free law of one variable at its port (`ranking/free_law.py`) has its
shape and every other one, so it leaves far less than an effect of the wrong shape. It leaves about
as much as the right effect, however much other missing physics leaves in both.
"""

from dataclasses import replace

from rigwatch.workbench.compare import Bench, apparent_strength
from rigwatch.workbench.explain.verdict import Verdict, judge
from rigwatch.workbench.ranking import STEP, Ranked, best_free_law, difference

STRONGER = 3.0
"""Smallest ratio of an effect's strength to its apparent strength on the healthy recording."""

OTHER_SHAPE = 0.7
"""Share of the energy above the floor, left by an effect, that a free law leaves if its shape is
wrong. On simulated machines right effects have 0.84 and more, wrong ones 0.19 to 0.6."""


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


def undetermined_if_another_law(bench: Bench, found: Verdict) -> Verdict:
    """The verdict, made undetermined if a free law at the effect's port explains far more.

    An effect that is named together with others is judged with them, down to the noise.
    """
    best = found.best
    if found.word != "missing_effect" or found.beside or best is None or best.fitted is None:
        return found
    if bench.floor.reached(best.fitted.held_out):
        return found
    law = best_free_law(bench.study, bench.data, bench.base, best.port)
    if law is None or difference(best.fitted.held_out, law.fitted.held_out).p_falls >= STEP:
        return found
    if bench.floor.left_over(best.fitted.held_out, law.fitted.held_out) > OTHER_SHAPE:
        return found
    left, least = (bench.floor.ratio(f.held_out) for f in (best.fitted, law.fitted))
    text = (
        f"{best.label} lowers the held-out error most, but leaves {left:.2g} times the noise floor,"
        f" and a free function of {law.variable} at {best.port} {least:.2g} times: the law there"
        " may be another, which is not in the library"
    )
    return replace(found, word="undetermined", text=text)
