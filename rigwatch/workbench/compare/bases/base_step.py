"""One step of the search for a base: which bases next to one do better on healthy recordings."""

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from rigwatch.physics.engine.compile import side_by_side
from rigwatch.physics.engine.fit import Fit
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.bases.base_fit import (
    Brief,
    Tried,
    brief_fit,
    fitted_base,
    judged,
    shared_values,
)
from rigwatch.workbench.compare.bases.base_neighbours import further_elements, further_variants
from rigwatch.workbench.data import Data, predicts_along_motion
from rigwatch.workbench.ranking import STEP, Progress, difference
from rigwatch.workbench.study import Study

T = TypeVar("T")
Fitting = Callable[[Study, Data, Mapping[str, float]], T]
WORTH = 0.02
"""Smallest relative fall of the held-out error that justifies more parameters."""
TOLERATED_RISE = 0.002
"""Largest relative rise of the held-out error accepted for fewer parameters."""
REJECT_RATIO = 1.1
"""Ratio of errors with and without a variant above which it is not combined with others."""
AT_NOISE = 1.1
"""Ratio of the held-out error to its noise at which nothing more is looked for."""
JUDGED = 3
"""Largest number of briefly fitted bases that are judged on all of the recordings."""


def improves(best: Tried, one: Tried) -> bool:
    """Whether a base is better by more than chance, or equal with fewer parameters."""
    found = difference(best.fitted.held_out, one.fitted.held_out)
    if one.base.parameters < best.base.parameters and found.relative > -TOLERATED_RISE:
        return True
    return found.p_falls < STEP and found.relative > WORTH


class BaseSearch:
    """Bases one step from another; each set is tried once."""

    def __init__(
        self, data: Data, start: Mapping[str, float], enough: float, progress: Progress
    ) -> None:
        self._data, self._start, self._enough, self._progress = data, start, enough, progress
        self._known: set[frozenset[str]] = set()
        self._rejected: set[str] = set()
        self._briefs: list[Brief] = []

    def first(self, study: Study) -> Tried:
        """The unmodified model."""
        if not predicts_along_motion(study):
            return fitted_base(study, self._data, self._start)
        return judged(brief_fit(study, self._data, self._start))

    def one_step(self, at: Tried) -> list[Tried]:
        """Bases next to one, fitted; elements once no variant alone does better."""
        if not at.data.along_motion:
            return self._each(at, self._new(further_variants(at, self._rejected)))
        if at.base.over_noise <= self._enough:
            return []
        found = list[Tried]()
        if not at.study.file.variants:
            found = self._briefly(at, self._new(further_variants(at, self._rejected)))
        if any(improves(at, one) for one in found):
            return found
        rest = [*further_variants(at, self._rejected), *further_elements(at, self._rejected)]
        return found + self._briefly(at, self._new(rest))

    def _new(self, bases: Sequence[Study]) -> list[Study]:
        """Those whose set of variants and elements has not been tried, whatever their values."""
        sets = [_labels(one) for one in bases]
        found = [one for one, own in zip(bases, sets, strict=True) if own not in self._known]
        self._known |= set(sets)
        return found

    def _each(self, at: Tried, bases: Sequence[Study]) -> list[Tried]:
        """Each base fitted to the whole recording."""
        found = []
        for one in bases:
            self._progress(f"fitting the model with {' and '.join(one.file.variants)}")
            tried = self._or_none(fitted_base, at.study, at.fitted.train, one)
            if tried is None or self._is_worse(tried.base.held_out_error, at.base.held_out_error):
                self._rejected.add(_label(one.file.variants[-1]))
            found += [] if tried is None else [tried]
        return found

    def _briefly(self, at: Tried, bases: Sequence[Study]) -> list[Tried]:
        """Each base fitted briefly along the motion, and the best of them judged."""
        self._progress(f"fitting {len(bases)} bases next to {_named(at.study)}")
        now, *first = side_by_side(
            lambda one: self._or_none(brief_fit, at.study, at.fitted.train, one),
            [at.study, *bases],
        )
        found = side_by_side(
            lambda pair: self._begun_anew(at, *pair), list(zip(bases, first, strict=True))
        )
        self._briefs += [one for one in found if one is not None]
        limit = np.inf if now is None else now.error
        for brief, one in zip(found, bases, strict=True):
            if brief is None or self._is_worse(brief.error, limit):
                self._rejected.add(_label(one.file.variants[-1]))
        best = sorted((one for one in found if one is not None), key=_error)
        return side_by_side(judged, best[:JUDGED])

    def _begun_anew(self, at: Tried, study: Study, found: Brief | None) -> Brief | None:
        """A brief fit; the better of two if the first ended above a base with less in it.

        With the other's values it would have ended below, so it ended in another minimum.

        Args:
            at: the base whose values it began from.
            study: the base fitted.
            found: its fit; None if it could not be fitted.
        """
        own, begun = _labels(study), _labels(at.study)
        within = [one for one in self._briefs if begun != _labels(one.study) < own]
        simpler = min(within, key=_error, default=None)
        if simpler is None or (found and not self._is_worse(found.error, simpler.error)):
            return found
        again = self._or_none(brief_fit, simpler.study, simpler.fit, study)
        return min((one for one in (found, again) if one), key=_error, default=None)

    def _is_worse(self, error: float, before: float) -> bool:
        return error > REJECT_RATIO * before

    def _or_none(self, fit: Fitting[T], before: Study, at: Fit, study: Study) -> T | None:
        """A base fitted from the values of another, or None if it cannot be fitted."""
        start = {**self._start, **shared_values(before, at, study)}
        try:
            return fit(study, self._data, start)
        except ModelError:
            return None


def _label(name: str) -> str:
    """The name of a variant or an element without its values."""
    return name.partition("(")[0]


def _labels(study: Study) -> frozenset[str]:
    """What a base has beside the unmodified model."""
    return frozenset(map(_label, study.file.variants))


def _error(brief: Brief) -> float:
    return brief.error


def _named(study: Study) -> str:
    return " and ".join(map(_label, study.file.variants)) or "the unmodified model"
