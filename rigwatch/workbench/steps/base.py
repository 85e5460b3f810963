"""Selects the variants of a study's model that its healthy recordings support.

A verdict is only as good as the base model. The model is fitted to the first part of the healthy
recordings and judged on the rest. Variants are then added one at a time, best first, as long as the
error on the rest falls, over blocks, by more than chance. A variant with fewer parameters is taken
if it does equally well. A variant may replace those of its group that it excludes.
"""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.equations import Model, check_variants, neighbours
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import (
    Data,
    along_motion,
    from_residual,
    predicts_along_motion,
    prepare,
    quiet_scale,
)
from rigwatch.workbench.fit import Fitted, fit_model, with_hold, with_kept_free
from rigwatch.workbench.ranking import STEP, Progress, difference, no_progress
from rigwatch.workbench.study import Study, check_data, commit, use_variants, varied

FIT_SHARE = 0.6
"""Share of a single healthy recording used for fitting; the rest decides."""
WORTH = 0.02
"""Smallest relative fall of the held-out error that justifies more parameters."""
TOLERATED_RISE = 0.002
"""Largest relative rise of the held-out error accepted for fewer parameters."""
REJECT_RATIO = 1.1
"""Ratio of errors with and without a variant above which it is not combined with others."""
ROUNDS = 4
"""Largest number of variants added."""

NO_HEALTHY = (
    "found no healthy recording, expected one: record a run with nothing wrong and list it under"
    " [[healthy]] in the study"
)


@dataclass(frozen=True)
class Base:
    """The study's model with some variants, fitted to the healthy recordings.

    Attributes:
        variants: their names; none is the unmodified model.
        train_error, held_out_error: rms over all channels, in standard deviations of the sensor
            noise.
        over_noise: the held-out error over its noise floor.
        parameters: number of fitted parameters.
        reason: the physics of the variants, in words.
    """

    variants: tuple[str, ...]
    train_error: float
    held_out_error: float
    over_noise: float
    parameters: int
    reason: str


@dataclass(frozen=True)
class Bases:
    """Result of the search for a base.

    Attributes:
        enough: the simplest base that no other tried beats.
        ranking: all bases tried, best first.
        remarks: notes for the user.
    """

    enough: Base
    ranking: list[Base]
    remarks: list[str]


@dataclass(frozen=True, eq=False)
class _Tried:
    base: Base
    fitted: Fitted
    model: Model


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
    search = _Search(varied(study, ()).with_effects(()), _split_healthy(data.healthy, data.horizon))
    progress("fitting the unmodified model")
    best = search.first()
    tried = [best]
    for _ in range(ROUNDS):
        candidates = _next(study.model, best, search.rejected)
        found = [search.attempt(best, names, progress) for names in candidates]
        fits = [one for one in found if one is not None]
        tried += fits
        better = [one for one in fits if _improves(best, one)]
        if not better:
            break
        best = min(better, key=lambda one: one.base.held_out_error)
    ranking = sorted((one.base for one in tried), key=lambda base: base.held_out_error)
    return Bases(best.base, ranking, list(search.remarks))


def take_base(study: Study, variants: Sequence[str]) -> Study:
    """Write these variants to the study's file and its ledger; return the changed study.

    Raises:
        ModelError: effects have been accepted on another base, or variants exclude each other.
    """
    if study.file.effects:
        label = f"{study.file.effects[-1].effect}@{study.file.effects[-1].port}"
        raise ModelError(
            f"{study.folder}: found {label} accepted on the current base, expected a study without"
            " effects; `rigwatch undo` removes them"
        )
    varied(study, variants)
    changed = use_variants(study, variants)
    commit(study, changed, "base", variants=list(variants), before=list(study.file.variants))
    return changed


def _next(model: Model, at: _Tried, rejected: Container[str]) -> list[tuple[str, ...]]:
    """Bases to try next: each further variant added, replacing those that it excludes."""
    return [n for n in neighbours(model, at.base.variants) if n[-1] not in rejected]


def _improves(best: _Tried, one: _Tried) -> bool:
    """Whether a base is better by more than chance, or equal with fewer parameters."""
    found = difference(best.fitted.held_out, one.fitted.held_out)
    if one.base.parameters < best.base.parameters and found.relative > -TOLERATED_RISE:
        return True
    return found.p_falls < STEP and found.relative > WORTH


class _Search:
    """Fits of the model with variants to the healthy recordings."""

    def __init__(self, study: Study, data: Data) -> None:
        self._study, self._data = study, data
        self._known: dict[frozenset[str], _Tried | None] = {}
        self.remarks: tuple[str, ...] = ()
        self.rejected: set[str] = set()

    def first(self) -> _Tried:
        """The unmodified model."""
        return self._fitted((), self._study.file.start, "the unmodified model")

    def attempt(self, at: _Tried, names: tuple[str, ...], progress: Progress) -> _Tried | None:
        """The model with these variants, started from another base's fit.

        None if the fit fails or the set has been tried already; each set is fitted once.
        """
        key = frozenset(names)
        if key in self._known:
            return None
        progress(f"fitting the model with {' and '.join(names)}")
        own = varied(self._study, names).model.parameters
        before, values = at.model.parameters, at.fitted.train.values()
        start = {n: values[n] for n, p in own.items() if n in values and before.get(n) == p}
        try:
            self._known[key] = self._fitted(names, start, _physics(self._study.model, names))
        except ModelError:
            self._known[key] = None
        found = self._known[key]
        if found is None or found.base.held_out_error > REJECT_RATIO * at.base.held_out_error:
            self.rejected.add(names[-1])
        return found

    def _fitted(self, names: tuple[str, ...], start: Mapping[str, float], reason: str) -> _Tried:
        study, data = varied(self._study, names), self._data
        written = study.model
        if predicts_along_motion(study):
            study, data = along_motion(study, data)
        self.remarks = data.remarks
        scale = quiet_scale(data.train)
        study = with_hold(study, data, scale)
        found = fit_model(
            replace(study, model=with_kept_free(study.model)),
            data,
            (),
            start,
            scale,
            multi_start=True,
        )
        noise = from_residual(found.held_out, data.held_out, study.file.period, data.horizon)
        base = Base(
            names,
            _overall(found.train.rms, scale),
            _overall(found.held_out.rms, scale),
            noise.ratio(found.held_out),
            len(found.compiled.system.free),
            reason,
        )
        return _Tried(base, found, written)


def _physics(model: Model, names: Sequence[str]) -> str:
    """The physics of variants, in words."""
    return " ".join(model.variants[name].physics for name in names)


def _overall(rms: FloatArray, scale: FloatArray) -> float:
    return float(np.sqrt(np.mean((rms / scale) ** 2)))


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
