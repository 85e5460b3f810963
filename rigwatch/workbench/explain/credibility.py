"""Effects that are not named although the held-out error falls with them.

An effect is credible only if it is clearly stronger than its apparent strength when healthy. Model
error mimics a little of every effect on a healthy recording; the apparent strength of an effect
there, to first order, is the part that model error can account for. Of a free run that is asked
where the model leaves no more than on the healthy recording and the effect explains little of it:
what explains most of it is named, also where the healthy machine has it.

What `add` refused in the study's present state is not named as missing: there the study was fitted
anew with the effect, and lost what a single fit had gained.

Nor is an effect that leaves most of the training of logs that are resampled where an input is held:
it changes between two new samples, and a controller that saturates does not feel its mean. That
concerns studies that ask for one rate; in others each log keeps its own.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench, apparent_strength
from rigwatch.workbench.data import RESAMPLED
from rigwatch.workbench.explain.remaining_error import LITTLE
from rigwatch.workbench.explain.verdict import Verdict, judge
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import Ranked
from rigwatch.workbench.study import Refusals, refused_as

STRONGER = 3.0
"""Smallest ratio of an effect's strength to its apparent strength on the healthy recording."""
MOST = 0.5
"""Share of the error's energy that an effect leaves from which it explains little of it."""
RESAMPLED_HELD = (
    "so little may be what resampling makes of a held input, which then changes between samples:"
    " log all recordings at one rate, or leave out what asks for one (rate, thin, period)"
)


def credible_verdict(bench: Bench, rows: list[Ranked], refused: Refusals) -> Verdict:
    """The verdict among the credible effects; the others are no longer accepted.

    Args:
        bench: the study.
        rows: the ranking.
        refused: what `add` refused in the study's present state.
    """
    for row in rows:
        if row.accepted and (reason := refused.get(refused_as(row.label, ()))) is not None:
            row.accepted, row.reason = False, f"as `add` found: {reason}"
    verdict = judge(bench.base, rows, bench.floor)
    while verdict.best is not None and apparent_when_healthy(bench, verdict.best):
        verdict.best.accepted = False
        verdict.best.reason = "nearly as strong on the healthy recording"
        verdict = judge(bench.base, rows, bench.floor)
    return verdict


def unless_refused(refused: Refusals, verdict: Verdict) -> Verdict:
    """The verdict; `unknown_effect` if `add` refused the set in which it names an effect."""
    if verdict.word != "missing_effect" or verdict.best is None:
        return verdict
    reason = refused.get(refused_as(verdict.best.label, verdict.beside))
    if reason is None:
        return verdict
    text = f"{verdict.text}; but `add` found: {reason}"
    return replace(verdict, word="unknown_effect", text=text)


def unless_resampled(bench: Bench, verdict: Verdict) -> Verdict:
    """The verdict; `undetermined` if what it names may be made by resampling a held input."""
    best, model = verdict.best, bench.study.model
    named_alone = verdict.word == "missing_effect" and not verdict.beside
    held = any(model.held(name) == "zero" for name in model.inputs)
    if best is None or best.fitted is None or not (named_alone and held):
        return verdict
    left = bench.floor.of_training.left_over(bench.base.train, best.fitted.train)
    if RESAMPLED not in bench.data.altered or left <= 1 - LITTLE:
        return verdict
    return replace(verdict, word="undetermined", text=f"{verdict.text}; {RESAMPLED_HELD}")


def still_holds(word: str, label: str, beside: Sequence[str], refused: Refusals) -> bool:
    """Whether `add` has not refused since what an explanation names.

    Args:
        word: the verdict.
        label: the effect that it names, as "effect@port".
        beside: the others of its set.
        refused: what `add` refused in the study's present state.
    """
    return word != "missing_effect" or refused_as(label, beside) not in refused


def apparent_when_healthy(bench: Bench, row: Ranked) -> bool:
    """Whether the effect appears nearly as strong on the healthy recording."""
    healthy = bench.data.of_healthy
    if healthy is None or bench.bare is None or row.fitted is None:
        return False
    if not (healthy.along_motion or _explains_little_of_healthy_error(bench, row.fitted)):
        return False
    p = row.placement.effect.parameters[row.placement.effect.strength]
    value = row.fitted.train.values()[row.placement.prefix + row.placement.effect.strength]
    seems = apparent_strength(healthy, bench.bare, row.placement, row.fitted)
    return abs(value - p.neutral) < STRONGER * abs(seems)


def _explains_little_of_healthy_error(bench: Bench, fitted: Fitted) -> bool:
    """Whether the model leaves no more than on the healthy recording, and an effect most of it."""
    share = (fitted.held_out_error / bench.base.held_out_error) ** 2
    return bench.floor.reached(bench.base.held_out) and share > MOST
