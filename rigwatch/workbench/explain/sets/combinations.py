"""Beam search for sets of effects that explain the error together, smallest sets first.

Each of the best sets of one size is put into the model, every other effect is scored against the
remaining residual, and the most promising are fitted with it: sets of the next size. The training
error selects the sets that are extended, so the held-out recordings are used only once, at the end.
It is that of states of effects which run through all windows, as on held-out recordings: fitted
window by window, they are a free constant each, and such a set leaves no place for others.
The search ends when a set reduces the residual to noise.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

from rigwatch.physics.engine.compile import side_by_side
from rigwatch.physics.engine.fit import Fit
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import NoiseFloor, held_out_floor
from rigwatch.workbench.explain.verdict import LITTLE_MORE
from rigwatch.workbench.fit import Fitted, continued_train_error, fit_model
from rigwatch.workbench.ranking import (
    AGAIN,
    MATERIAL,
    MUCH_WORSE,
    STEP,
    Progress,
    Ranked,
    accepted_from,
    candidates,
    difference,
    refit,
    scored,
    select_for_fit,
)
from rigwatch.workbench.study import Study

BEAM_WIDTH = 3
"""Number of sets of each size that are extended."""
BRANCHES = 3
"""Number of effects fitted with each of these sets."""
MAX_EFFECTS = 3
"""Largest number of effects in a set."""
_SCORED: WeakKeyDictionary[Fitted, list[Ranked]] = WeakKeyDictionary()
"""Scores of all effects by the fit they were scored along; sets share the fits of their parts."""
UNLIMITED = 1000
"""More parameters than any set can have."""


@dataclass(frozen=True, eq=False)
class Combination:
    """A set of effects in the model.

    Attributes:
        rows: each effect as fitted with those before it in the model.
        search_error: training error by which the search compares sets of one size.
    """

    rows: tuple[Ranked, ...]
    search_error: float = float("inf")

    @property
    def fitted(self) -> Fitted:
        """The fit with all effects."""
        found = self.rows[-1].fitted
        assert found is not None
        return found

    @property
    def labels(self) -> frozenset[str]:
        """The effects, as "effect@port"."""
        return frozenset(row.label for row in self.rows)

    @property
    def free(self) -> int:
        """Number of free parameters of all effects."""
        return sum(row.free for row in self.rows)


def floor_of(bench: Bench, fitted: Fitted) -> NoiseFloor:
    """The noise floor for a fit; without a healthy recording, from its own residual.

    The base model's residual contains missing physics even in its quietest band.
    """
    if bench.data.of_healthy is not None or bench.floor.method != "quiet band":
        return bench.floor
    return held_out_floor(bench.study, bench.data, fitted.held_out)


def reaches_noise(bench: Bench, fitted: Fitted) -> bool:
    """Whether a fit reduces the residual to its noise floor."""
    return floor_of(bench, fitted).reached(fitted.held_out)


def with_rows(study: Study, rows: Sequence[Ranked]) -> Study:
    """The study with these effects in its model, in memory only."""
    return study.with_effects([*study.file.effects, *map(accepted_from, rows)])


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
    found = [_combination(bench, (row,)) for row in rows if row.fitted is not None]
    first = [each for each in found if each.free < free and _lowers(each, bench.base.train_error)]
    level = _best_in_training(first)
    for size in range(2, MAX_EFFECTS + 1):
        if not level:
            break
        progress(f"trying {size} effects at once")
        level = _best_in_training(_extended(bench, level, free, last=size == MAX_EFFECTS))
        found += level
        if any(reaches_noise(bench, each.fitted) for each in level):
            return found
    best = min(found, key=lambda each: each.search_error, default=None)
    if best is not None and len(best.rows) > 1:
        found += _improved(bench, best)
    return found


def _combination(bench: Bench, rows: tuple[Ranked, ...]) -> Combination:
    """A set of the search."""
    fitted = rows[-1].fitted
    assert fitted is not None
    try:
        return Combination(rows, continued_train_error(fitted, bench.data))
    except ModelError:
        return Combination(rows)


def _lowers(larger: Combination, smaller: float) -> bool:
    """Whether the training error falls by the amount required for acceptance."""
    return larger.search_error <= (1 - MATERIAL) * smaller


def _best_in_training(level: Sequence[Combination]) -> list[Combination]:
    """The sets of one size with the smallest training errors, none much like a better one."""
    chosen: list[Combination] = []
    for each in sorted(level, key=lambda each: each.search_error):
        if len(chosen) < BEAM_WIDTH and not any(_similar(each, other) for other in chosen):
            chosen.append(each)
    return chosen


def _similar(one: Combination, other: Combination) -> bool:
    """Whether two sets differ by one effect only, which looks alike at the same port."""
    own = [row for row in one.rows if row.label not in other.labels]
    theirs = [row for row in other.rows if row.label not in one.labels]
    if len(own) != 1 or len(theirs) != 1:
        return False
    (a,), (b,) = own, theirs
    return a.port == b.port and (b.label in a.alike or a.label in b.alike)


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
        if not _lowers(better, best.search_error) or reaches_noise(bench, better.fitted):
            break
        best = better
    return found


def _exchanged(
    bench: Bench, best: Combination, tried: Collection[frozenset[str]]
) -> Iterator[Combination]:
    """Each set with one of its effects exchanged for one that resembles it, at any port.

    As only sets that reach the noise are used, it must explain a share of what is above the noise.

    Args:
        bench: the study.
        best: the set.
        tried: labels of sets that were fitted already.
    """
    for row in best.rows:
        rest = without(bench, best, row)
        if rest is None:
            continue
        every = _scored_with(bench, rest)
        least = _least_share(bench, rest)
        yield from _all_fitted(bench, [
            (rest, other)
            for other in _substitutes(row, every)
            if rest.labels | {other.label} not in tried and other.explained >= least
        ])  # fmt: skip


def _all_fitted(bench: Bench, larger: Sequence[tuple[Combination, Ranked]]) -> list[Combination]:
    """Sets with another effect each, fitted side by side; without those that cannot be fitted."""
    found = side_by_side(lambda each: _enlarged(bench, *each), larger)
    return [each for each in found if each is not None]


def _enlarged(bench: Bench, known: Combination, row: Ranked) -> Combination | None:
    """A set with another effect; None if it cannot be fitted."""
    _fit_with(bench, known.rows, known.fitted, row)
    return None if row.fitted is None else _combination(bench, (*known.rows, row))


def _substitutes(row: Ranked, every: Sequence[Ranked]) -> list[Ranked]:
    """The best that look alike or belong to the family, at the same port and at others."""
    family = row.placement.effect.family

    def resembles(each: Ranked) -> bool:
        kin = bool(family) and each.placement.effect.family == family
        return each.label != row.label and (kin or each.label in row.alike)

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
    waiting: list[tuple[Combination, Ranked]] = []
    for known in level:
        least = _least_share(bench, known) if last else 0.0
        waiting += [
            (known, row)
            for row in next_candidates(bench, known)
            if known.free + row.free <= free and row.explained >= least
        ]
    found: dict[frozenset[str], Combination] = {}
    while waiting:
        # A set made in two ways is fitted the second way only if the first does not help.
        first = {known.labels | {row.label}: (known, row) for known, row in reversed(waiting)}
        now = [each for each in waiting if each in first.values()]
        smaller = {known.labels | {row.label}: known for known, row in now}
        for larger in _all_fitted(bench, now):
            if _lowers(larger, smaller[larger.labels].search_error):
                found[larger.labels] = larger
        waiting = [
            (known, row)
            for known, row in waiting
            if (known, row) not in now and known.labels | {row.label} not in found
        ]
    return list(found.values())


def _least_share(bench: Bench, known: Combination) -> float:
    """Share of the error's energy that an effect must explain for a set to come near the noise."""
    return AGAIN * floor_of(bench, known.fitted).above(known.fitted.held_out)


def next_candidates(bench: Bench, known: Combination) -> list[Ranked]:
    """The effects that match the residual of a set best."""
    every = _scored_with(bench, known)
    kind = "dynamic" if bench.study.model.states else "static"
    return select_for_fit(every, kind, at_floor=False)[:BRANCHES]


def _scored_with(bench: Bench, known: Combination) -> list[Ranked]:
    """All other effects, scored with a set in the model; computed once for each fit."""
    if known.fitted not in _SCORED:
        study = with_rows(bench.study, known.rows)
        found = candidates(study, bench.data.train)
        _SCORED[known.fitted] = scored(study, bench.data, known.fitted, found)
    # A fit and its reasons are stored in a row.
    return [replace(row) for row in _SCORED[known.fitted]]


def _fit_with(bench: Bench, rows: Sequence[Ranked], fitted: Fitted, row: Ranked) -> None:
    """Fit an effect with others in the model, starting from their fit."""
    refit(with_rows(bench.study, rows), bench.data, fitted, row, fit_model)


def without(bench: Bench, whole: Combination, left_out: Ranked) -> Combination | None:
    """A set without one of its effects; None if the rest cannot be fitted.

    The effects before it were fitted without it.
    """
    at = whole.rows.index(left_out)
    rows = [*whole.rows[:at]]
    fitted = Combination(tuple(rows)).fitted if rows else bench.base
    for row in whole.rows[at + 1 :]:
        own = replace(row)
        _fit_with(bench, rows, fitted, own)
        if own.fitted is None:
            return None
        fitted, rows = own.fitted, [*rows, own]
    return Combination(tuple(rows))


def simplest_of_best(every: Sequence[Combination]) -> Combination:
    """Of the sets no worse than the one with the smallest error, the one with fewest parameters."""
    least = min(every, key=lambda each: each.fitted.held_out_error)
    equals = [each for each in every if not_worse(each, least)]
    return min(equals, key=lambda each: (each.free, each.fitted.held_out_error))


def not_worse(each: Combination, best: Combination) -> bool:
    """Whether a set is no worse than another, neither in training nor held out.

    A rare event, such as a drive at rest, may occur on only one of the two sides.
    """
    one, other = each.fitted, best.fitted
    sides = ((one.train, other.train), (one.held_out, other.held_out))
    return each is best or not any(_worse(*fits) for fits in sides)


def _worse(one: Fit, other: Fit) -> bool:
    """Whether one error is larger than the other, by more than chance or by a large ratio."""
    found = difference(one, other)
    far_larger = found.relative > 1 - 1 / MUCH_WORSE
    return far_larger or (found.p_falls < STEP and found.relative > LITTLE_MORE)
