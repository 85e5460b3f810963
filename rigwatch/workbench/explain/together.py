"""Where one effect alone does not explain the error: what every good explanation holds is missing.

One effect that does not explain all takes a part of what others do, and the more so the more
parameters it has. So it is judged beside the others: of the sets of effects that explain the error
best, one is taken, and each of its effects is ranked against all others with the rest of the set in
the model. It is missing where it wins there, and where no other set that does as well goes without.
Where no set leaves nothing but noise, something else is missing too, and the verdict is that on one
effect.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.combinations import (
    ANY,
    Combination,
    as_good,
    combinations,
    fewest_of_the_best,
    leaves_noise,
    own_floor,
    with_rows,
    without,
)
from rigwatch.workbench.explain.verdict import Verdict, judge
from rigwatch.workbench.explain.verdict_calibration import Evidence
from rigwatch.workbench.ranking import (
    EXPLAINED,
    Progress,
    Ranked,
    left_over,
    rank,
    refit,
)

ROUNDS = 3
"""Times that effects of a set are exchanged for better ones."""


@dataclass(frozen=True, eq=False)
class _Part:
    """One effect of a set, judged beside the rest of it."""

    row: Ranked
    verdict: Verdict

    @property
    def named(self) -> frozenset[str]:
        """It, its class and its rivals."""
        return frozenset((*self.verdict.members, *self.verdict.rivals))

    @property
    def certain(self) -> bool:
        """Whether it wins beside the rest."""
        return self.verdict.word == "missing_effect"


def several_effects(
    bench: Bench, rows: Sequence[Ranked], verdict: Verdict, progress: Progress
) -> Verdict:
    """The verdict once sets of effects have been tried; as it was where none does better than one.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        verdict: on them.
        progress: told what begins.
    """
    every = combinations(bench, rows, progress, _most_free(bench, verdict.best))
    if not any(len(each.rows) > 1 and leaves_noise(bench, each.fitted) for each in every):
        return verdict
    best = fewest_of_the_best(every)
    parts: list[_Part] = []
    for _ in range(ROUNDS):
        if len(best.rows) == 1:
            return _not_simpler(verdict, best, every)
        better, parts = _judged_in_turn(bench, best, progress)
        if better is None:
            break
        every, best = [*every, better], better
    others = [each for each in every if as_good(each, best) and len(each.rows) <= len(best.rows)]
    return _said(bench, rows, verdict, best, [_doubted(part, best, others) for part in parts])


def alone_is_not_enough(bench: Bench, verdict: Verdict) -> bool:
    """Whether more than one effect may be missing.

    The best leaves more than little, or has a shape of its own, which may stand for a second one.
    """
    if verdict.word == "nothing_missing":
        return False
    best = verdict.best
    return best is None or best.free > 1 or not _leaves_little(bench, best)


def _most_free(bench: Bench, best: Ranked | None) -> int:
    """Parameters of a set: no more than those of one effect that leaves little."""
    return best.free if best is not None and _leaves_little(bench, best) else ANY


def _leaves_little(bench: Bench, best: Ranked) -> bool:
    """Whether an effect alone leaves nothing but noise, or next to nothing."""
    if best.fitted is None:
        return False
    left = left_over(bench.base, best, bench.floor)
    return left < 1 - EXPLAINED or leaves_noise(bench, best.fitted)


def _not_simpler(verdict: Verdict, best: Combination, every: Sequence[Combination]) -> Verdict:
    """The verdict on one effect, with others that together do as well by as many parameters."""
    named = {*verdict.members, *verdict.rivals}
    instead = [
        each
        for each in every
        if len(each.rows) > 1
        and each.free <= best.free
        and not each.labels & named
        and as_good(each, best)
    ]
    if not instead or verdict.word != "missing_effect":
        return verdict
    least = min(instead, key=lambda each: each.fitted.held_out_error)
    together = " with ".join(row.label for row in least.rows)
    text = f"{verdict.text}; {together} explains it as well"
    rivals = (*verdict.rivals, *(row.label for row in least.rows))
    return replace(verdict, word="undetermined", rivals=rivals, text=text)


def _judged_in_turn(
    bench: Bench, best: Combination, progress: Progress
) -> tuple[Combination | None, list[_Part]]:
    """A better set, where an effect is better exchanged for another; the verdict on each effect."""
    parts = []
    for row in best.rows:
        rest = without(bench, best, row)
        if rest is None:
            continue
        progress(f"judging {row.label} beside {', '.join(sorted(rest.labels))}")
        study, floor = with_rows(bench.study, rest.rows), own_floor(bench, best.fitted)
        found = judge(rest.fitted, rank(study, bench.data, rest.fitted, floor), floor)
        other = found.best
        if other is not None and other.label != row.label:
            better = Combination((*rest.rows, other))
            if better.fitted.held_out_error < best.fitted.held_out_error:
                return better, []
        parts.append(_Part(row, found))
    return None, parts


def _doubted(part: _Part, best: Combination, others: Sequence[Combination]) -> _Part:
    """An effect, with what takes its place in sets that do as well without it or its like."""
    without_it = [each for each in others if not each.labels & part.named]
    instead = sorted(frozenset().union(*(each.labels - best.labels for each in without_it)))
    if part.verdict.best is None or not instead:
        return part
    rivals = (*part.verdict.rivals, *instead)
    return replace(part, verdict=replace(part.verdict, word="undetermined", rivals=rivals))


def _said(
    bench: Bench,
    rows: Sequence[Ranked],
    verdict: Verdict,
    best: Combination,
    parts: Sequence[_Part],
) -> Verdict:
    """The verdict on the set: one of its effects in front, the next of them as well."""
    alone = {row.label: row for row in rows}
    known = [part for part in parts if part.verdict.best and part.row.label in alone]
    # What is accepted alone goes first, as it can be added first; of these what leaves least alone.
    order = sorted(known, key=lambda part: (
        not part.certain, not alone[part.row.label].accepted, alone[part.row.label].held_out_error
    ))  # fmt: skip
    if not order or order[0].verdict.word == "unknown_effect":
        return _unsupported(verdict, best)
    first, then = order[0], [part for part in order[1:] if part.certain]
    row = alone[first.row.label]
    if row.fitted is None:
        refit(bench.study, bench.data, bench.base, row)
    found, second = first.verdict, then[0].verdict.members if first.certain and then else ()
    left = own_floor(bench, best.fitted).left_over(bench.base.held_out, best.fitted.held_out)
    return replace(
        found,
        best=row,
        text=f"beside {', '.join(sorted(best.labels - {row.label}))}: {found.text}{_how(row)}",
        second=second,
        evidence=Evidence(left, found.evidence.margin),
    )


def _how(row: Ranked) -> str:
    """How to add an effect that is not accepted alone; empty where it is."""
    return "" if row.accepted else "; alone it is refused: add it with --anyway, then the others"


def _unsupported(verdict: Verdict, best: Combination) -> Verdict:
    """The verdict on one effect, where it has no place in what explains the error better."""
    if (
        verdict.best is None
        or verdict.word == "unknown_effect"
        or verdict.best.label in best.labels
    ):
        return verdict
    rivals = tuple(sorted({*verdict.rivals, *best.labels}))
    text = f"{', '.join(sorted(best.labels))} together explain more than {verdict.best.label}"
    return replace(verdict, word="undetermined", rivals=rivals, text=text)
