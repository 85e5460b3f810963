"""Sets with another effect: scored, tried on a part of long recordings, fitted to the whole."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any
from weakref import WeakKeyDictionary

from rigwatch.physics.engine.compile import side_by_side
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.sets.combination import (
    Combination,
    best_in_training,
    combination_of,
    with_rows,
)
from rigwatch.workbench.explain.sets.part_trial import Trial, tried
from rigwatch.workbench.fit import Fitted, TrainingPart, part_of
from rigwatch.workbench.ranking import (
    MATERIAL,
    Order,
    Ranked,
    candidates,
    fit_started,
    order_of,
    refit,
    scored,
)

_ON_PART: WeakKeyDictionary[Fitted, float] = WeakKeyDictionary()
"""Errors of fits on the part of the training; a fit belongs to one study."""
_SCORED: WeakKeyDictionary[Fitted, dict[bool, list[Ranked]]] = WeakKeyDictionary()
"""Scores of all effects by the fit they were scored along, and by whether the whole library was
ranked: sets share the fits of their parts, and a second pass those of the first."""

_Begun = tuple[Any, ...]
_TRIED: WeakKeyDictionary[Fitted, dict[_Begun, Trial | None]] = WeakKeyDictionary()
_FITTED: WeakKeyDictionary[Fitted, dict[_Begun, Ranked]] = WeakKeyDictionary()
"""Trials and fits of a further effect beside those of a fit, by the effect and where they began: a
second pass makes many of the sets of the first once more."""


@dataclass(frozen=True, eq=False)
class Larger:
    """A set with another effect, not fitted yet.

    Attributes:
        known: the set.
        row: the effect.
        trial: both fitted to a part of the training; None if that was not done.
    """

    known: Combination
    row: Ranked
    trial: Trial | None = None

    @property
    def labels(self) -> frozenset[str]:
        """The effects, as "effect@port"."""
        return self.known.labels | {self.row.label}

    @property
    def error(self) -> float:
        """Error on the part of the training; 0 if it was not fitted to one."""
        return self.trial.error if self.trial else 0.0


def _part(bench: Bench) -> TrainingPart | None:
    """The part of the training on which sets are tried; None if it is short."""
    return part_of(bench.study, bench.data)


def all_tried(bench: Bench, waiting: Sequence[tuple[Combination, Ranked]]) -> list[Larger]:
    """Sets with another effect each, fitted to a part of the training if that is long.

    Without those that cannot be fitted.
    """
    part = _part(bench)
    if part is None:
        return [Larger(*each) for each in waiting]

    def larger(each: tuple[Combination, Ranked]) -> Larger:
        known, row = each
        kept, begun = _TRIED.setdefault(known.fitted, {}), _begun(row)
        if begun not in kept:
            study = with_rows(bench.study, known.rows)
            kept[begun] = tried(study, part, known.fitted, row)
        return Larger(known, row, kept[begun])

    return [each for each in side_by_side(larger, waiting) if each.trial]


def most_promising(bench: Bench, waiting: Sequence[Larger]) -> list[Larger]:
    """Those that leave least of a part of the training; all if they were not fitted to one."""
    if _part(bench) is None:
        return list(waiting)
    lower = [
        each for each in waiting if each.error <= (1 - MATERIAL) * error_on_part(bench, each.known)
    ]
    # Of a set made in two ways, the better.
    every = {each.labels: each for each in sorted(lower, key=lambda each: -each.error)}
    sets = [Combination((*each.known.rows, each.row), each.error) for each in every.values()]
    return [every[each.labels] for each in best_in_training(sets)]


def error_on_part(bench: Bench, known: Combination) -> float:
    """Error of a set on a part of the training, computed once; infinite if it is not known."""
    if known.fitted not in _ON_PART:
        part = _part(bench)
        try:
            _ON_PART[known.fitted] = part.error(known.fitted) if part else math.inf
        except ModelError:
            _ON_PART[known.fitted] = math.inf
    return _ON_PART[known.fitted]


def _begun(row: Ranked, starts: Mapping[Order, Mapping[str, float]] | None = None) -> _Begun:
    """An effect, and where its fit begins."""
    begins = [row.begin(), *(starts or {}).values()]
    return row.label, *(starts or {}), *(tuple(sorted(values.items())) for values in begins)


def all_fitted(bench: Bench, larger: Sequence[Larger]) -> list[Combination]:
    """Sets with another effect each, fitted side by side; without those that cannot be fitted."""
    found = side_by_side(lambda each: _enlarged(bench, each), larger)
    return [each for each in found if each is not None]


def _enlarged(bench: Bench, larger: Larger) -> Combination | None:
    """A set with another effect; None if it cannot be fitted."""
    known, row = larger.known, larger.row
    fit_with(bench, known.rows, known.fitted, row, larger.trial.starts if larger.trial else {})
    return None if row.fitted is None else combination_of(bench, (*known.rows, row))


def scored_with(bench: Bench, known: Combination) -> list[Ranked]:
    """All other effects, scored with a set in the model; computed once for each fit."""
    kept = _SCORED.setdefault(known.fitted, {})
    whole = bench.study.file.whole_library
    if whole not in kept:
        study, part = with_rows(bench.study, known.rows), _part(bench)
        found = candidates(study, bench.data.train)
        if part is None:
            kept[whole] = scored(study, bench.data, known.fitted, found)
        else:
            kept[whole] = scored(study, part.data, part.of(known.fitted), found)
    # A fit and its reasons are stored in a row.
    return [replace(row) for row in kept[whole]]


def fit_with(
    bench: Bench,
    rows: Sequence[Ranked],
    fitted: Fitted,
    row: Ranked,
    starts: Mapping[Order, Mapping[str, float]] = MappingProxyType({}),
) -> None:
    """Fit an effect with others in the model, starting from their fit; once from the same start.

    Args:
        bench: the study.
        rows: the others.
        fitted: their fit.
        row: the effect, to which its fit and the decision are stored.
        starts: parameters to begin with, by the effect's place before or after others at its port.
    """
    kept, begun = _FITTED.setdefault(fitted, {}), _begun(row, starts)
    if begun not in kept:
        fitting = fit_started(lambda _, placements: starts.get(order_of(placements[-1]), {}))
        refit(with_rows(bench.study, rows), bench.data, fitted, row, fitting)
        kept[begun] = replace(row)
    row.take(kept[begun])
