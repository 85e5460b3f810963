"""The verdict if a single effect does not explain the error.

An effect that explains only part of the error also absorbs part of what other effects cause, and
more of it the more parameters it has. Each effect is therefore judged together with the others. One
of the sets of effects that explain the error best is selected, and each of its effects is ranked
against all candidates while the rest of the set is in the model. An effect is named as missing if
it comes first there and if every equally good set contains it. If no set reduces the residual to
noise, something else is missing as well, and the verdict on single effects stands. If that names
none, its text says what the best set leaves, and what every equally good set has in common. If it
names one, and a set without it leaves far less than any with it, the verdict is undetermined; a set
with no more parameters need only leave less (`as_simple`).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.explain.remaining_error import shows_little_of_it
from rigwatch.workbench.explain.sets.as_simple import by_set_as_simple, with_set_told
from rigwatch.workbench.explain.sets.combination import (
    Combination,
    floor_of,
    not_worse,
    reaches_noise,
    with_rows,
)
from rigwatch.workbench.explain.sets.combinations import (
    UNLIMITED,
    at_its_best,
    combinations,
    simplest_of_best,
    without,
)
from rigwatch.workbench.explain.verdict import Verdict, judge
from rigwatch.workbench.explain.verdict_calibration import Evidence
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import (
    EXPLAINED,
    MATERIAL,
    MUCH_WORSE,
    Progress,
    Ranked,
    fit_started,
    in_order,
    left_over,
    rank,
    refit,
)

UNNAMED = ("undetermined", "unknown_effect")
MANY = 3
"""Laws at one port that together follow nearly any law."""
ROUNDS = 4
"""Largest number of times that an effect of the set is left out, or replaced by a better one."""


@dataclass(frozen=True, eq=False)
class _Member:
    """One effect of a set, judged with the rest of the set in the model, which leaves `without`."""

    row: Ranked
    verdict: Verdict
    ranked: Sequence[Ranked] = ()
    without: Fitted | None = None

    @property
    def named(self) -> frozenset[str]:
        """The effect named, its class and its rivals."""
        return frozenset((*self.verdict.members, *self.verdict.rivals))

    @property
    def certain(self) -> bool:
        """Whether it is named without rivals."""
        return self.verdict.word == "missing_effect"


def several_effects(
    bench: Bench, rows: Sequence[Ranked], verdict: Verdict, progress: Progress
) -> Verdict:
    """The verdict after trying sets of effects; the same if no set reduces the residual to noise.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        verdict: the verdict on single effects.
        progress: called with a line of text as each part begins.
    """
    every = combinations(bench, rows, progress, _max_parameters(bench, verdict.best))
    if not every:
        return verdict
    best = simplest_of_best(every)
    if not any(len(each.rows) > 1 and reaches_noise(bench, each.fitted) for each in every):
        return _with_best_set(bench, rows, verdict, best, every)
    parts: list[_Member] = []
    for _ in range(ROUNDS):
        if len(best.rows) == 1:
            return _with_equal_sets(verdict, best, every)
        better, parts = _judge_each(bench, best, progress)
        if better is None:
            break
        every, best = [*every, better], better
    others = [each for each in every if not_worse(each, best) and len(each.rows) <= len(best.rows)]
    return _set_verdict(
        bench, rows, verdict, best, [_with_alternatives(part, best, others) for part in parts]
    )


def with_similar(verdict: Verdict, rows: Sequence[Ranked]) -> Verdict:
    """The verdict on an effect of a set that is refused alone, undetermined beside similar ones.

    The others of the set can bend one law into another, as a sensor's curvature makes convection of
    radiation, and alone the recording does not support it. Similar are effects at its port that the
    library calls so and that are nearly as good.

    Args:
        verdict: names the effect with confidence.
        rows: the ranking that it is of, in the model with the others of the set.
    """
    best = verdict.best
    assert best is not None
    similar = tuple(
        row.label
        for row in rows
        if row.accepted and row.label not in verdict.members and row.port == best.port
        if row.effect in best.placement.effect.confused_with
        if row.held_out_error < MUCH_WORSE * best.held_out_error
    )
    if not similar:
        return verdict
    text = f"{best.label} and {', '.join(similar)} explain it nearly equally well"
    return replace(verdict, word="undetermined", rivals=similar, text=text)


def may_need_several(bench: Bench, verdict: Verdict) -> bool:
    """Whether more than one effect may be missing.

    The best leaves a considerable residual, or has shape parameters that may mimic a second effect.
    """
    if verdict.word == "nothing_missing":
        return False
    best = verdict.best
    return best is None or best.free > 1 or not _leaves_little(bench, best)


def _max_parameters(bench: Bench, best: Ranked | None) -> int:
    """Largest number of parameters of a set: those of a single effect that leaves little."""
    return best.free if best is not None and _leaves_little(bench, best) else UNLIMITED


def _leaves_little(bench: Bench, best: Ranked) -> bool:
    """Whether a single effect reduces the residual to noise, or nearly so, also in training."""
    if best.fitted is None:
        return False
    little = left_over(bench.base, best, bench.floor) < 1 - EXPLAINED
    little = little and not shows_little_of_it(bench.base, best, bench.floor)
    return little or reaches_noise(bench, best.fitted)


def _with_best_set(
    bench: Bench,
    rows: Sequence[Ranked],
    verdict: Verdict,
    best: Combination,
    every: Sequence[Combination],
) -> Verdict:
    """The verdict with what the best set leaves in its text, or in doubt of the named effect."""
    if verdict.word == "missing_effect":
        found = by_set_as_simple(bench, rows, verdict, every) or _doubted(verdict, every)
        return with_set_told(bench, verdict, every) if found is verdict else found
    if verdict.word not in UNNAMED or len(best.rows) == 1:
        return verdict
    text = f"{verdict.text}; {_joined(best.labels)} together leave"
    text += f" {best.fitted.told_error:.3g} {best.fitted.told_in}"
    equals = [each.labels for each in every if not_worse(each, best)]
    common = frozenset.intersection(*equals)
    if common and common != best.labels:
        text += f", and each of the {len(equals)} sets that are as good contains {_joined(common)}"
    return replace(verdict, text=text)


def _doubted(verdict: Verdict, every: Sequence[Combination]) -> Verdict:
    """The verdict on one effect; undetermined if a set without it leaves far less than any with it.

    Alone an effect may win by taking a part of what several others cause.
    """
    named = {*verdict.members, *verdict.rivals}
    least = [
        min(
            (each for each in every if bool(each.labels & named) == contains),
            key=lambda each: each.fitted.held_out_error,
            default=None,
        )
        for contains in (True, False)
    ]
    own, other = least
    if other is None or len(other.rows) == 1:
        return verdict
    left = min(each.fitted.held_out_error for each in (own, verdict.best) if each and each.fitted)
    if other.fitted.held_out_error * MUCH_WORSE > left:
        return verdict
    return _undetermined_by_sets(verdict, other)


def _joined(labels: Collection[str]) -> str:
    return ", ".join(sorted(labels))


def _with_equal_sets(verdict: Verdict, best: Combination, every: Sequence[Combination]) -> Verdict:
    """The verdict on one effect; undetermined if a set of other effects is equally good.

    Sets with more parameters do not count.
    """
    named = {*verdict.members, *verdict.rivals}
    instead = [
        each
        for each in every
        if len(each.rows) > 1
        and each.free <= best.free
        and not each.labels & named
        and not_worse(each, best)
    ]
    if not instead or verdict.word != "missing_effect":
        return verdict
    least = min(instead, key=lambda each: each.fitted.held_out_error)
    together = " with ".join(row.label for row in least.rows)
    text = f"{verdict.text}; {together} explains it as well"
    rivals = (*verdict.rivals, *(row.label for row in least.rows))
    return replace(verdict, word="undetermined", rivals=rivals, text=text)


def _judge_each(
    bench: Bench, best: Combination, progress: Progress
) -> tuple[Combination | None, list[_Member]]:
    """A better set if leaving out or replacing an effect gives one, and the verdict on each."""
    each_left_out = [(row, without(bench, best, row)) for row in best.rows]
    rests = [
        (row, at_its_best(bench, rest, best)) for row, rest in each_left_out if rest is not None
    ]
    as_good = [rest for _, rest in rests if not_worse(rest, best)]
    if as_good:
        # A needless effect takes part of another's, and hides what that cannot be told from.
        return min(as_good, key=lambda rest: rest.fitted.held_out_error), []
    parts = []
    for row, rest in rests:
        progress(f"judging {row.label} together with {_joined(rest.labels)}")
        floor = floor_of(bench, best.fitted)
        ranking = _ranked_with(bench, rest, row, best, floor)
        found = judge(rest.fitted, ranking, floor)
        other = found.best
        if other is not None and other.label != row.label:
            better = Combination((*rest.rows, other))
            if better.fitted.held_out_error < best.fitted.held_out_error:
                return better, []
        parts.append(_Member(row, found, ranking, rest.fitted))
    return None, parts


def _ranked_with(
    bench: Bench, rest: Combination, row: Ranked, best: Combination, floor: NoiseFloor
) -> list[Ranked]:
    """All effects beside the rest of a set; the set's own is fitted, whichever it looks like.

    A fit of it that ends above that of the set is begun anew there: from the rest alone it ended in
    another minimum.
    """
    study = with_rows(bench.study, rest.rows)
    rows = rank(study, bench.data, rest.fitted, floor)
    within, known = best.fitted.train_error * (1 + MATERIAL), best.fitted.train.values()
    for own in rows:
        if own.label != row.label or own.failure:
            continue
        if own.fitted is None or own.fitted.train_error > within:
            refit(study, bench.data, rest.fitted, own, fit_started(lambda *_: known))
    return in_order(rows)


def _with_alternatives(part: _Member, best: Combination, others: Sequence[Combination]) -> _Member:
    """An effect, undetermined if equally good sets contain neither it nor its class or rivals."""
    without_it = [each for each in others if not each.labels & part.named]
    instead = sorted(frozenset().union(*(each.labels - best.labels for each in without_it)))
    if part.verdict.best is None or not instead:
        return part
    rivals = tuple(dict.fromkeys((*part.verdict.rivals, *instead)))
    text = f"{part.verdict.best.label} and {', '.join(rivals)} explain it equally well"
    undetermined = replace(part.verdict, word="undetermined", rivals=rivals, text=text)
    return replace(part, verdict=undetermined)


def _set_verdict(
    bench: Bench,
    rows: Sequence[Ranked],
    verdict: Verdict,
    best: Combination,
    parts: Sequence[_Member],
) -> Verdict:
    """The verdict on the set: one effect is named first, the next certain one second."""
    alone = {row.label: row for row in rows}
    known = [part for part in parts if part.verdict.best and part.row.label in alone]
    # Effects accepted alone come first, as they can be added first, best first.
    order = sorted(known, key=lambda part: (
        not part.certain, not alone[part.row.label].accepted, alone[part.row.label].held_out_error
    ))  # fmt: skip
    if not order or order[0].verdict.word == "unknown_effect":
        return _undetermined_by_sets(verdict, best)
    first, then = order[0], [part for part in order[1:] if part.certain]
    others = tuple(each.label for each in best.rows if each.label != first.row.label)
    row = _named_alone(first, alone)
    if row.fitted is None:
        refit(bench.study, bench.data, bench.base, row)
    if _follows_any_law(best):
        return _undetermined_among(verdict, row, best)
    if not row.accepted and first.certain:
        first = replace(first, verdict=with_similar(first.verdict, first.ranked))
    found, second = first.verdict, then[0].verdict.members if first.certain and then else ()
    left = floor_of(bench, best.fitted).left_over(bench.base.held_out, best.fitted.held_out)
    return replace(
        found,
        best=row,
        text=f"beside {_rest(bench, others, first)}, {found.text}{_how_to_add(row, others)}",
        second=second,
        evidence=Evidence(left, found.evidence.margin),
        beside=others,
        together=found.best.fitted if found.best is not None else None,
    )


def _follows_any_law(best: Combination) -> bool:
    """Whether a set is of so many laws at one port that a law which is none of them passes for it.

    As three stiffnesses with places of their own do for a stall with hysteresis.
    """
    return len(best.rows) >= MANY and len({row.port for row in best.rows}) == 1


def _undetermined_among(verdict: Verdict, row: Ranked, best: Combination) -> Verdict:
    """The verdict where a set of laws at one port leaves only noise; `row` is of one of them."""
    text = (
        f"{_joined(best.labels)} together leave {best.fitted.told_error:.3g}"
        f" {best.fitted.told_in}, but so many laws at one port follow nearly any other:"
        " one that is not in the library may be missing there"
    )
    rivals = tuple(sorted({*verdict.rivals, *best.labels} - {row.label}))
    return replace(verdict, word="undetermined", best=row, rivals=rivals, text=text)


def _named_alone(part: _Member, alone: Mapping[str, Ranked]) -> Ranked:
    """The row without the set of what a verdict names, which may be another of the class."""
    named = part.verdict.best
    return alone[named.label if named is not None and named.label in alone else part.row.label]


def _rest(bench: Bench, others: Sequence[str], part: _Member) -> str:
    """The rest of a set, and from where to where it brings the held-out error without the named."""
    if part.without is None:
        return _joined(others)
    before, left = bench.base.told_error, part.without.told_error
    errors = f"the held-out error from {before:.3g} to {left:.3g} {bench.base.told_in}"
    alone = "which by itself takes" if len(others) == 1 else "which by themselves take"
    return f"{_joined(others)}, {alone} {errors}"


def _how_to_add(row: Ranked, others: Sequence[str]) -> str:
    """How to add an effect that is not accepted alone; empty if it is accepted."""
    if row.accepted:
        return ""
    return f"; alone it is refused: add it with --port {row.port} --with {' '.join(others)}"


def _undetermined_by_sets(verdict: Verdict, best: Combination) -> Verdict:
    """The verdict on one effect; undetermined if a better set does not contain it."""
    if (
        verdict.best is None
        or verdict.word == "unknown_effect"
        or verdict.best.label in best.labels
    ):
        return verdict
    rivals = tuple(sorted({*verdict.rivals, *best.labels}))
    text = f"{_joined(best.labels)} together explain more than {verdict.best.label}"
    return replace(verdict, word="undetermined", rivals=rivals, text=text)
