"""Selects the base of a study that its healthy recordings support.

A verdict is only as good as the base model. The model is fitted to the first part of the healthy
recordings and judged on the rest. Variants of its laws and effects that a healthy machine has are
then added one at a time, best first, as long as the error on the rest falls, over blocks, by more
than chance. A variant with fewer parameters is taken if it does equally well. A variant may replace
those of its group that it excludes.

Along the measured motion every candidate is fitted briefly, to the beginning of the recording.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from rigwatch.physics.engine.compile import side_by_side
from rigwatch.physics.engine.equations import check_variants
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.base_fit import (
    Base,
    Tried,
    brief_fit,
    fitted_base,
    judged,
    shared_values,
)
from rigwatch.workbench.compare.base_neighbours import further_elements, further_variants
from rigwatch.workbench.data import Data, predicts_along_motion, prepare
from rigwatch.workbench.ranking import STEP, Progress, difference, no_progress
from rigwatch.workbench.study import Study, check_data, varied

T = TypeVar("T")
FIT_SHARE = 0.6
"""Share of a single healthy recording used for fitting; the rest decides."""
WORTH = 0.02
"""Smallest relative fall of the held-out error that justifies more parameters."""
TOLERATED_RISE = 0.002
"""Largest relative rise of the held-out error accepted for fewer parameters."""
REJECT_RATIO = 1.1
"""Ratio of errors with and without a variant above which it is not combined with others."""
ROUNDS = 4
"""Largest number of variants and elements added."""
AT_NOISE = 1.1
"""Ratio of the held-out error to its noise at which nothing more is looked for."""

JUDGED = 3
"""Largest number of briefly fitted bases that are judged on all of the recordings."""

NO_HEALTHY = (
    "found no healthy recording, expected one: record a run with nothing wrong and list it under"
    " [[healthy]] in the study"
)


@dataclass(frozen=True)
class Bases:
    """Result of the search for a base.

    Attributes:
        enough: the simplest base that no other tried beats.
        ranking: all bases fitted to the whole recording, best first.
        remarks: notes for the user.
        start: fitted values of the parameters of `enough`, by name in SI.
    """

    enough: Base
    ranking: list[Base]
    remarks: list[str]
    start: dict[str, float]


def find_base(study: Study, progress: Progress = no_progress) -> Bases:
    """Search for the variants of the study's model that its healthy recordings support.

    Args:
        study: the study; its accepted effects are ignored.
        progress: called with a line of text as each fit begins.

    Raises:
        ModelError: there is no healthy recording, the model has no variants, or cannot be fitted.
    """
    check_data(study)
    if not study.model.variants:
        raise ModelError(f"{study.file.model}: found no [variants], expected some to choose from")
    check_variants(varied(study, ()).model, study.file.model)
    data = prepare(study)
    if data.healthy is None:
        raise ModelError(f"{study.folder}: {NO_HEALTHY}")
    split = _split_healthy(data.healthy, data.horizon)
    search = _Search(split, study.file.start, progress)
    progress("fitting the unmodified model")
    best = search.first(varied(study, ()).with_effects(()))
    tried = [best]
    for _ in range(ROUNDS):
        fits = search.one_step(best)
        tried += fits
        better = [one for one in fits if improves(best, one)]
        if not better:
            break
        best = min(better, key=lambda one: one.base.held_out_error)
    ranking = sorted((one.base for one in tried), key=lambda base: base.held_out_error)
    values = best.fitted.train.values()
    start = {name: values[name] for name in best.fitted.compiled.system.free}
    return Bases(best.base, ranking, list(best.data.remarks), start)


def improves(best: Tried, one: Tried) -> bool:
    """Whether a base is better by more than chance, or equal with fewer parameters."""
    found = difference(best.fitted.held_out, one.fitted.held_out)
    if one.base.parameters < best.base.parameters and found.relative > -TOLERATED_RISE:
        return True
    return found.p_falls < STEP and found.relative > WORTH


class _Search:
    """Bases one step from another; each set is tried once."""

    def __init__(self, data: Data, start: Mapping[str, float], progress: Progress) -> None:
        self._data, self._start, self._progress = data, start, progress
        self._known: set[frozenset[str]] = set()
        self._rejected: set[str] = set()

    def first(self, study: Study) -> Tried:
        """The unmodified model."""
        if not predicts_along_motion(study):
            return fitted_base(study, self._data, self._start)
        return judged(brief_fit(study, self._data, self._start))

    def one_step(self, at: Tried) -> list[Tried]:
        """Bases next to one, fitted; elements once no variant alone does better."""
        if not at.data.along_motion:
            return self._each(at, self._new(further_variants(at, self._rejected)))
        if at.base.over_noise <= AT_NOISE:
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
        sets = [frozenset(map(_label, one.file.variants)) for one in bases]
        found = [one for one, own in zip(bases, sets, strict=True) if own not in self._known]
        self._known |= set(sets)
        return found

    def _each(self, at: Tried, bases: Sequence[Study]) -> list[Tried]:
        """Each base fitted to the whole recording."""
        found = []
        for one in bases:
            self._progress(f"fitting the model with {' and '.join(one.file.variants)}")
            tried = _or_none(fitted_base, one, self._data, self._from(at, one))
            if tried is None or self._is_worse(tried.base.held_out_error, at.base.held_out_error):
                self._rejected.add(_label(one.file.variants[-1]))
            found += [] if tried is None else [tried]
        return found

    def _briefly(self, at: Tried, bases: Sequence[Study]) -> list[Tried]:
        """Each base fitted briefly along the motion, and the best of them judged."""
        self._progress(f"fitting {len(bases)} bases next to {_named(at.study)}")
        now, *found = side_by_side(
            lambda one: _or_none(brief_fit, one, self._data, self._from(at, one)),
            [at.study, *bases],
        )
        limit = np.inf if now is None else now.error
        for brief, one in zip(found, bases, strict=True):
            if brief is None or self._is_worse(brief.error, limit):
                self._rejected.add(_label(one.file.variants[-1]))
        best = sorted((one for one in found if one is not None), key=lambda one: one.error)
        return side_by_side(judged, best[:JUDGED])

    def _is_worse(self, error: float, before: float) -> bool:
        return error > REJECT_RATIO * before

    def _from(self, at: Tried, study: Study) -> dict[str, float]:
        return {**self._start, **shared_values(at, study)}


def _or_none(fit: Callable[..., T], *given: Any) -> T | None:
    """A base, or None if it cannot be fitted."""
    try:
        return fit(*given)
    except ModelError:
        return None


def _label(name: str) -> str:
    """The name of a variant or an element without its values."""
    return name.partition("(")[0]


def _named(study: Study) -> str:
    return " and ".join(map(_label, study.file.variants)) or "the unmodified model"


def _split_healthy(healthy: Recording, horizon: int) -> Data:
    """Splits the healthy data: the last of several recordings, or the end of one, is held out."""
    parts = healthy.parts or (len(healthy),)
    if len(parts) > 1:
        cut, first, rest = sum(parts[:-1]), parts[:-1], parts[-1:]
    else:
        cut = max(round(FIT_SHARE * len(healthy)) // horizon, 1) * horizon
        first, rest = (cut,), (len(healthy) - cut,)
    if rest[0] < horizon:
        raise ModelError(
            f"healthy: found {len(healthy) * healthy.dt:.3g} s, expected at least two horizons of"
            f" {horizon * healthy.dt:g} s: one to fit and one that decides"
        )
    return Data(_cut(healthy, 0, cut, first), _cut(healthy, cut, None, rest), None, horizon, ())


def _cut(whole: Recording, begin: int, end: int | None, parts: tuple[int, ...]) -> Recording:
    thinning = replace(whole.thinning, parts=parts) if whole.thinning else None
    return Recording(whole.dt, whole.inputs[begin:end], whole.outputs[begin:end], thinning, parts)
