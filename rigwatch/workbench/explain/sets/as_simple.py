"""The verdict on an effect that a set with no more parameters betters on all recordings.

A law with a shape of its own bends into the likeness of two plain ones: friction that falls with
speed over all the motion there is, beside viscous friction, is dry friction and a drag that grows.
Where no set leaves only noise the effect that leads alone is named, and the set would be lost.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench
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

    If what leads without the named effect is the same physics at the same port and belongs to the
    set, that is named. Otherwise nothing is named with confidence.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        verdict: names an effect with confidence.
        every: the sets that were fitted.
    """
    named, best = verdict.best, _as_simple(verdict, every)
    if named is None or named.fitted is None or best is None:
        return None
    left = f"{', '.join(sorted(best.labels))} together, with no more parameters, leave"
    left += f" {best.fitted.told_error:.3g} {best.fitted.told_in}"
    plain = judge(bench.base, [row for row in rows if row is not named], bench.floor)
    if plain.word == "missing_effect" and _is_plainer(plain.best, named, best):
        text = f"{plain.text}; {named.label} leaves {named.fitted.told_error:.3g}, but {left}"
        return replace(plain, text=text)
    rivals = tuple(sorted({*verdict.rivals, *best.labels}))
    text = f"{named.label} lowers the held-out error most of single effects, but {left}"
    return replace(verdict, word="undetermined", rivals=rivals, text=text)


def _as_simple(verdict: Verdict, every: Sequence[Combination]) -> Combination | None:
    """The best set that betters the named effect with other effects and no more parameters.

    None if a set with the named effect leaves far less: then that only needs company.
    """
    named, known = verdict.best, {*verdict.members, *verdict.rivals}
    assert named is not None
    assert named.fitted is not None
    sets = [each for each in every if len(each.rows) > 1]
    own = [each.fitted.held_out_error for each in sets if each.labels & known]
    return min(
        (
            each
            for each in sets
            if not each.labels & known
            and each.free <= named.free
            and each.fitted.held_out_error < MUCH_WORSE * min(own, default=float("inf"))
            and _betters(each.fitted, named.fitted)
        ),
        key=lambda each: each.fitted.held_out_error,
        default=None,
    )


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
