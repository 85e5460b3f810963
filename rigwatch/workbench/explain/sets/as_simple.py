"""The verdict on an effect beside a set of others that has no more parameters.

A law with a shape of its own bends into the likeness of two plain ones: friction that falls with
speed over all the motion there is, beside viscous friction, is dry friction and a drag that grows.
Where no set leaves only noise the effect that leads alone is named, and the set would be lost.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.contradicting import leaves_less_of_all, others_may_favour
from rigwatch.workbench.explain.sets.combination import Combination
from rigwatch.workbench.explain.verdict import Verdict, judge
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import (
    MATERIAL,
    MUCH_WORSE,
    STEP,
    Ranked,
    difference,
    same_family,
)


def by_set_as_simple(
    bench: Bench, rows: Sequence[Ranked], verdict: Verdict, every: Sequence[Combination]
) -> Verdict | None:
    """The verdict if a set without the named effect is as simple and leaves less; otherwise None.

    If a set leaves less by more than chance, and what leads without the named effect is the same
    physics at the same port and belongs to the set, that is named. Otherwise nothing is named with
    confidence. So it is if the effect leaves much, and a set leaves less of all recordings
    together: which of the two leads where is then chance, as with single effects.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        verdict: names an effect with confidence.
        every: the sets that were fitted.
    """
    named = verdict.best
    if named is None or named.fitted is None:
        return None
    sets, fitted = _as_simple(verdict, every), named.fitted
    better = _least(each for each in sets if _betters(each.fitted, fitted))
    if better is None:
        less = _least(each for each in sets if leaves_less_of_all(each.fitted, fitted))
        if less is None or not others_may_favour(bench.base, named, bench.floor):
            return None
        return _undetermined(verdict, named, less)
    plain = judge(bench.base, [row for row in rows if row is not named], bench.floor)
    if plain.word == "missing_effect" and _is_plainer(plain.best, named, better):
        text = f"{plain.text}; {named.label} leaves {fitted.told_error:.3g}, but {_leaves(better)}"
        return replace(plain, text=text)
    return _undetermined(verdict, named, better)


def with_set_told(bench: Bench, verdict: Verdict, every: Sequence[Combination]) -> Verdict:
    """The verdict with a set as simple in its text, if that may be what is missing instead.

    Args:
        bench: the study.
        verdict: names an effect with confidence.
        every: the sets that were fitted.
    """
    named = verdict.best
    if named is None or named.fitted is None:
        return verdict
    near = MUCH_WORSE * named.held_out_error
    best = _least(s for s in _as_simple(verdict, every) if s.fitted.held_out_error < near)
    if best is None or not others_may_favour(bench.base, named, bench.floor):
        return verdict
    favours = f"and what else is missing may favour {named.label}"
    return replace(verdict, text=f"{verdict.text}; {_leaves(best)}, {favours}")


def _undetermined(verdict: Verdict, named: Ranked, instead: Combination) -> Verdict:
    rivals = tuple(sorted({*verdict.rivals, *instead.labels}))
    text = f"{named.label} lowers the held-out error most of single effects, but {_leaves(instead)}"
    return replace(verdict, word="undetermined", rivals=rivals, text=text)


def _leaves(each: Combination) -> str:
    together = f"{', '.join(sorted(each.labels))} together, with no more parameters, leave"
    return f"{together} {each.fitted.told_error:.3g} {each.fitted.told_in}"


def _as_simple(verdict: Verdict, every: Sequence[Combination]) -> list[Combination]:
    """The sets of other effects than the named one that have no more parameters.

    Empty if a set with the named effect leaves far less: that then only needs company.
    """
    named, known = verdict.best, {*verdict.members, *verdict.rivals}
    assert named is not None
    sets = [each for each in every if len(each.rows) > 1]
    own = [each.fitted.held_out_error for each in sets if each.labels & known]
    most = MUCH_WORSE * min(own, default=float("inf"))
    others = [each for each in sets if not each.labels & known and each.free <= named.free]
    return [each for each in others if each.fitted.held_out_error < most]


def _least(sets: Iterable[Combination]) -> Combination | None:
    return min(sets, key=lambda each: each.fitted.held_out_error, default=None)


def _betters(one: Fitted, other: Fitted) -> bool:
    """Whether a fit leaves materially less than another, by more than chance, on both sides."""
    sides = ((other.train, one.train), (other.held_out, one.held_out))
    falls = [difference(*fits) for fits in sides]
    return all(fall.p_falls < STEP and fall.relative > MATERIAL for fall in falls)


def _is_plainer(plain: Ranked | None, named: Ranked, best: Combination) -> bool:
    """Whether an effect of the set is the named one's physics at its port."""
    if plain is None or plain.label not in best.labels:
        return False
    return plain.port == named.port and same_family(named, plain)
