"""Selects the base of a study that its healthy recordings support.

A verdict is only as good as the base model. The model is fitted to the first part of the healthy
recordings and judged on the rest. Variants of its laws and effects that a healthy machine has are
then added one at a time, best first, as long as the error on the rest falls, over blocks, by more
than chance. A variant with fewer parameters is taken if it does equally well. A variant may replace
those of its group that it excludes.

Along the measured motion every candidate is fitted briefly, to the beginning of the recording.
"""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.equations import check_variants
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.base_fit import (
    Base,
    Tried,
    briefly_fitted,
    fitted_base,
    posed_base,
    shared_values,
)
from rigwatch.workbench.compare.base_neighbours import neighbouring_bases
from rigwatch.workbench.compare.brief_fits import all_fitted
from rigwatch.workbench.data import Data, predicts_along_motion, prepare
from rigwatch.workbench.ranking import STEP, Progress, difference, no_progress
from rigwatch.workbench.study import Study, check_data, varied

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
        better = [one for one in fits if _improves(best, one)]
        if not better:
            break
        best = min(better, key=lambda one: one.base.held_out_error)
    ranking = sorted((one.base for one in tried), key=lambda base: base.held_out_error)
    values = best.fitted.train.values()
    start = {name: values[name] for name in best.fitted.compiled.system.free}
    return Bases(best.base, ranking, list(best.data.remarks), start)


def _improves(best: Tried, one: Tried) -> bool:
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
        posed = posed_base(study, self._data, self._start)
        brief = all_fitted([posed.search])[0]
        if brief is None:
            raise ModelError(f"{study.model.name}: found no fit to the healthy recording")
        return briefly_fitted(posed, brief)

    def one_step(self, at: Tried) -> list[Tried]:
        """Fits of the bases next to one."""
        if at.base.over_noise <= AT_NOISE and at.data.along_motion:
            return []
        bases = [one for one in neighbouring_bases(at, self._rejected) if self._is_new(one)]
        fit = self._briefly if at.data.along_motion else self._each
        found = fit(at, bases)
        for one in bases:
            errors = [t.base.held_out_error for t in found if t.study is one]
            if min(errors, default=np.inf) > REJECT_RATIO * at.base.held_out_error:
                self._rejected.add(one.file.variants[-1].partition("(")[0])
        return found

    def _is_new(self, study: Study) -> bool:
        """Whether this set of variants and elements has not been tried, whatever their values."""
        names = frozenset(name.partition("(")[0] for name in study.file.variants)
        if names in self._known:
            return False
        self._known.add(names)
        return True

    def _each(self, at: Tried, bases: Sequence[Study]) -> list[Tried]:
        found = []
        for one in bases:
            self._progress(f"fitting the model with {' and '.join(one.file.variants)}")
            with contextlib.suppress(ModelError):
                found.append(fitted_base(one, self._data, self._from(at, one)))
        return found

    def _briefly(self, at: Tried, bases: Sequence[Study]) -> list[Tried]:
        named = ", ".join(one.file.variants[-1].partition("(")[0] for one in bases)
        self._progress(f"fitting the model with {named}")
        posed = []
        for one in bases:
            with contextlib.suppress(ModelError):
                posed.append(posed_base(one, self._data, self._from(at, one)))
        briefs = all_fitted([one.search for one in posed])
        pairs = zip(posed, briefs, strict=True)
        return [briefly_fitted(one, brief) for one, brief in pairs if brief is not None]

    def _from(self, at: Tried, study: Study) -> dict[str, float]:
        return {**self._start, **shared_values(at, study)}


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
