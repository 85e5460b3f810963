"""Sets of effects that explain the error together, searched from the smallest on.

Each of the best sets of one size is a base beside which every effect is scored again, and the
likeliest are fitted with it: the next size. The training chooses what is carried on, so that the
recordings held out are asked once, at the end. It ends where a set leaves nothing but noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rigwatch.physics.engine.fit import Fit
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import NoiseFloor, from_residual
from rigwatch.workbench.explain.verdict import LITTLE_MORE, MUCH_WORSE
from rigwatch.workbench.fit import Fitted, fit_model
from rigwatch.workbench.ranking import (
    MATERIAL,
    STEP,
    Progress,
    Ranked,
    accepted_from,
    candidates,
    difference,
    refit,
    scored,
    worth_a_fit,
)
from rigwatch.workbench.study import Study

WIDTH = 3
"""Sets of one size that are carried on."""
BRANCHES = 3
"""Effects that are fitted beside each."""
MOST = 3
"""Effects of a set."""
ANY = 1000
"""More parameters than a set can have."""


@dataclass(frozen=True, eq=False)
class Combination:
    """Effects in the model at once.

    Attributes:
        rows: each as it was fitted beside those before it.
    """

    rows: tuple[Ranked, ...]

    @property
    def fitted(self) -> Fitted:
        """The fit with all of them."""
        found = self.rows[-1].fitted
        assert found is not None
        return found

    @property
    def labels(self) -> frozenset[str]:
        """Which effects."""
        return frozenset(row.label for row in self.rows)

    @property
    def free(self) -> int:
        """Parameters that a fit of them moves."""
        return sum(row.free for row in self.rows)


def own_floor(bench: Bench, fitted: Fitted) -> NoiseFloor:
    """The floor of a fit: without a healthy recording its own residual tells more than the base's.

    What is missing from the base fills the band that is quietest with it, too.
    """
    if bench.data.of_healthy is not None or bench.floor.method != "quiet band":
        return bench.floor
    period = bench.study.file.period
    return from_residual(fitted.held_out, bench.data.held_out, period, bench.data.horizon)


def leaves_noise(bench: Bench, fitted: Fitted) -> bool:
    """Whether a fit leaves nothing but noise, by its own floor."""
    return own_floor(bench, fitted).reached(fitted.held_out)


def with_rows(study: Study, rows: Sequence[Ranked]) -> Study:
    """The study with these effects in its model, in memory alone."""
    return study.with_effects([*study.file.effects, *map(accepted_from, rows)])


def combinations(
    bench: Bench, rows: Sequence[Ranked], progress: Progress, free: int = ANY
) -> list[Combination]:
    """Every set that was fitted, the single effects first.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        progress: told what begins.
        free: parameters that a fit of a set may move.
    """
    found = [Combination((row,)) for row in rows if row.fitted is not None]
    first = [each for each in found if each.free < free and _lowers(each.fitted, bench.base)]
    level = _carried_on(first)
    for size in range(2, MOST + 1):
        if not level:
            break
        progress(f"trying {size} effects at once")
        level = _carried_on(_larger(bench, level, free))
        found += level
        if any(leaves_noise(bench, each.fitted) for each in level):
            break
    return found


def _lowers(larger: Fitted, smaller: Fitted) -> bool:
    """Whether an effect lowers the training error by as much as it must to be accepted."""
    return larger.train_error <= (1 - MATERIAL) * smaller.train_error


def _carried_on(level: Sequence[Combination]) -> list[Combination]:
    """The sets of one size that leave least in training."""
    return sorted(level, key=lambda each: each.fitted.train_error)[:WIDTH]


def _larger(bench: Bench, level: Sequence[Combination], free: int) -> list[Combination]:
    """Each set with one effect more, no set twice."""
    found: dict[frozenset[str], Combination] = {}
    for known in level:
        for row in beside(bench, known):
            if known.labels | {row.label} in found or known.free + row.free > free:
                continue
            _fit_beside(bench, known.rows, known.fitted, row)
            if row.fitted is not None and _lowers(row.fitted, known.fitted):
                found[known.labels | {row.label}] = Combination((*known.rows, row))
    return list(found.values())


def beside(bench: Bench, known: Combination) -> list[Ranked]:
    """The effects that what a set leaves looks like most."""
    study = with_rows(bench.study, known.rows)
    every = scored(study, bench.data, known.fitted, candidates(study, bench.data.train))
    return worth_a_fit(every, "dynamic" if study.model.states else "static")[:BRANCHES]


def _fit_beside(bench: Bench, rows: Sequence[Ranked], fitted: Fitted, row: Ranked) -> None:
    """Fit an effect beside others, from the fit with these."""
    refit(with_rows(bench.study, rows), bench.data, fitted, row, fit_model)


def without(bench: Bench, whole: Combination, left_out: Ranked) -> Combination | None:
    """A set without one of its effects; None where that cannot be fitted."""
    rest = [row for row in whole.rows if row is not left_out]
    fitted, rows = bench.base, list[Ranked]()
    for row in rest:
        own = replace(row)
        _fit_beside(bench, rows, fitted, own)
        if own.fitted is None:
            return None
        fitted, rows = own.fitted, [*rows, own]
    return Combination(tuple(rows))


def fewest_of_the_best(every: Sequence[Combination]) -> Combination:
    """Of those that do as well as the one that leaves least, the one with the fewest parameters."""
    least = min(every, key=lambda each: each.fitted.held_out_error)
    equals = [each for each in every if as_good(each, least)]
    return min(equals, key=lambda each: (each.free, each.fitted.held_out_error))


def as_good(each: Combination, best: Combination) -> bool:
    """Whether neither side tells that the other one is better.

    What happens seldom on one side, such as a drive at rest, may show on the other alone.
    """
    one, other = each.fitted, best.fitted
    sides = ((one.train, other.train), (one.held_out, other.held_out))
    return each is best or not any(_worse(*fits) for fits in sides)


def _worse(one: Fit, other: Fit) -> bool:
    """Whether one leaves more than the other, beyond chance or beyond all measure."""
    found = difference(one, other)
    beyond_measure = found.relative > 1 - 1 / MUCH_WORSE
    return beyond_measure or (found.p_falls < STEP and found.relative > LITTLE_MORE)
