"""Beam search for sets of effects that explain the error together, smallest sets first.

Each of the best sets of one size is put into the model, every other effect is scored against the
remaining residual, and the most promising are fitted with it: sets of the next size. The training
error selects the sets that are extended, so the held-out recordings are used only once, at the end.
It is that of states of effects which run through all windows, as on held-out recordings: fitted
window by window, they are a free constant each, and such a set leaves no place for others.
The search ends when a set reduces the residual to noise. Of long recordings, effects are scored and
sets first fitted on a part (`part_trial`).
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.sets.combination import (
    Combination,
    best_in_training,
    combination_of,
    floor_of,
    lowers,
    not_worse,
    reaches_noise,
)
from rigwatch.workbench.explain.sets.enlarging import (
    all_fitted,
    all_tried,
    error_on_part,
    fit_with,
    most_promising,
    scored_with,
)
from rigwatch.workbench.fit import begun_from_larger
from rigwatch.workbench.ranking import (
    AGAIN,
    MUCH_WORSE,
    Progress,
    Ranked,
    same_family,
    select_for_fit,
)

BRANCHES = 3
"""Number of effects fitted with each of these sets."""
MAX_EFFECTS = 3
"""Largest number of effects in a set."""
UNLIMITED = 1000
"""More parameters than any set can have."""


def combinations(
    bench: Bench, rows: Sequence[Ranked], progress: Progress, free: int = UNLIMITED
) -> list[Combination]:
    """All sets that were fitted, single effects first.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        progress: called with a line of text as each size begins.
        free: largest number of free parameters of a set.
    """
    found = [combination_of(bench, (row,)) for row in rows if row.fitted is not None]
    first = [each for each in found if each.free < free and lowers(each, bench.base.train_error)]
    level = best_in_training(first)
    for size in range(2, MAX_EFFECTS + 1):
        if not level:
            break
        progress(f"trying {size} effects at once")
        level = best_in_training(_extended(bench, level, free, last=size == MAX_EFFECTS))
        found += level
        if any(reaches_noise(bench, each.fitted) for each in level):
            return found
    best = min(found, key=lambda each: each.search_error, default=None)
    if best is not None and len(best.rows) > 1:
        found += _improved(bench, best)
    return found


def _improved(bench: Bench, best: Combination) -> list[Combination]:
    """Sets made from the best by exchanging its effects one at a time, as long as that helps.

    The search extends the better of two that look alike, such as a lag and a delay, or an offset
    of a sensor and a constant force. With the others in the model the other one may be better, and
    only when one is right does it show in its turn which of the next two is.
    """
    found: list[Combination] = []
    for _ in range(MAX_EFFECTS):
        tried = {each.labels for each in found}
        found += _exchanged(bench, best, tried)
        better = min(found, key=lambda each: each.search_error, default=best)
        if not lowers(better, best.search_error) or reaches_noise(bench, better.fitted):
            break
        best = better
    return found


def _exchanged(
    bench: Bench, best: Combination, tried_before: Collection[frozenset[str]]
) -> Iterator[Combination]:
    """Each set with one of its effects exchanged for one that resembles it, at any port.

    As only sets that reach the noise are used, it must explain a share of what is above the noise,
    and leave little more of a part of the training than the best.

    Args:
        bench: the study.
        best: the set.
        tried_before: labels of sets that were fitted already.
    """
    for row in best.rows:
        rest = without(bench, best, row)
        if rest is None:
            continue
        every = scored_with(bench, rest)
        least = _least_share(bench, rest)
        waiting = all_tried(bench, [
            (rest, other)
            for other in _substitutes(row, every)
            if rest.labels | {other.label} not in tried_before and other.explained >= least
        ])  # fmt: skip
        most = MUCH_WORSE * error_on_part(bench, best)
        yield from all_fitted(bench, [each for each in waiting if each.error <= most])


def _substitutes(row: Ranked, every: Sequence[Ranked]) -> list[Ranked]:
    """The best that look alike or belong to the family, at the same port and at others."""

    def resembles(each: Ranked) -> bool:
        return each.label != row.label and (same_family(row, each) or each.label in row.alike)

    alike = [each for each in every if resembles(each)]
    here = [each for each in alike if each.port == row.port]
    elsewhere = [each for each in alike if each.port != row.port]
    return [*here[:BRANCHES], *elsewhere[:BRANCHES]]


def _extended(
    bench: Bench, level: Sequence[Combination], free: int, *, last: bool
) -> list[Combination]:
    """Each set extended by one effect, without duplicates.

    Only sets that reach the noise are used of the last size, so its effect must explain a share of
    what is above the noise, to first order.
    """
    pairs: list[tuple[Combination, Ranked]] = []
    for known in level:
        least = _least_share(bench, known) if last else 0.0
        pairs += [
            (known, row)
            for row in next_candidates(bench, known)
            if known.free + row.free <= free and row.explained >= least
        ]
    waiting = most_promising(bench, all_tried(bench, pairs))
    found: dict[frozenset[str], Combination] = {}
    while waiting:
        # A set made in two ways is fitted the second way only if the first does not help.
        first = {each.labels: each for each in reversed(waiting)}
        now = [each for each in waiting if each in first.values()]
        for larger in all_fitted(bench, now):
            if lowers(larger, first[larger.labels].known.search_error):
                found[larger.labels] = larger
        waiting = [each for each in waiting if each not in now and each.labels not in found]
    return list(found.values())


def _least_share(bench: Bench, known: Combination) -> float:
    """Share of the error's energy that an effect must explain for a set to come near the noise."""
    return AGAIN * floor_of(bench, known.fitted).above(known.fitted.held_out)


def next_candidates(bench: Bench, known: Combination) -> list[Ranked]:
    """The effects that match the residual of a set best."""
    every = scored_with(bench, known)
    kind = "dynamic" if bench.study.model.states else "static"
    return select_for_fit(every, kind, at_floor=False)[:BRANCHES]


def without(bench: Bench, whole: Combination, left_out: Ranked) -> Combination | None:
    """A set without one of its effects; None if the rest cannot be fitted.

    The effects before it were fitted without it.
    """
    at = whole.rows.index(left_out)
    rows = [*whole.rows[:at]]
    fitted = Combination(tuple(rows)).fitted if rows else bench.base
    for row in whole.rows[at + 1 :]:
        own = replace(row)
        fit_with(bench, rows, fitted, own)
        if own.fitted is None:
            return None
        fitted, rows = own.fitted, [*rows, own]
    return Combination(tuple(rows))


def at_its_best(bench: Bench, rest: Combination, whole: Combination) -> Combination:
    """A set without one of its effects, begun where the whole set ended if it leaves less there.

    The effect left out may only have led the others out of a local minimum.
    """
    fitted = begun_from_larger(bench.study, bench.data, rest.fitted, whole.fitted)
    if fitted is rest.fitted:
        return rest
    return Combination((*rest.rows[:-1], replace(rest.rows[-1], fitted=fitted)))


def simplest_of_best(every: Sequence[Combination]) -> Combination:
    """Of the sets no worse than the one with the smallest error, the one with fewest parameters."""
    least = min(every, key=lambda each: each.fitted.held_out_error)
    equals = [each for each in every if not_worse(each, least)]
    return min(equals, key=lambda each: (each.free, each.fitted.held_out_error))
