"""A set of effects in the model, and which of several are the better ones."""

from collections.abc import Sequence
from dataclasses import dataclass

from rigwatch.physics.engine.fit import Fit
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import NoiseFloor, held_out_floor
from rigwatch.workbench.explain.verdict import LITTLE_MORE
from rigwatch.workbench.fit import Fitted, continued_train_error
from rigwatch.workbench.ranking import MATERIAL, MUCH_WORSE, STEP, Ranked, accepted_from, difference
from rigwatch.workbench.study import Study

BEAM_WIDTH = 3
"""Number of sets of each size that are extended."""


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
    return held_out_floor(bench.study, bench.data, fitted.train, fitted.held_out)


def reaches_noise(bench: Bench, fitted: Fitted) -> bool:
    """Whether a fit reduces the residual to its noise floor."""
    return floor_of(bench, fitted).reached(fitted.held_out)


def with_rows(study: Study, rows: Sequence[Ranked]) -> Study:
    """The study with these effects in its model, in memory only."""
    return study.with_effects([*study.file.effects, *map(accepted_from, rows)])


def combination_of(bench: Bench, rows: tuple[Ranked, ...]) -> Combination:
    """A set of the search."""
    fitted = rows[-1].fitted
    assert fitted is not None
    try:
        return Combination(rows, continued_train_error(fitted, bench.data))
    except ModelError:
        return Combination(rows)


def lowers(larger: Combination, smaller: float) -> bool:
    """Whether the training error falls by the amount required for acceptance."""
    return larger.search_error <= (1 - MATERIAL) * smaller


def best_in_training(level: Sequence[Combination]) -> list[Combination]:
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
