"""Which variants of a study's model its healthy recordings speak for, and taking them.

A verdict is worth as much as the model that it stands on. The model is fitted to the first part of
what was recorded with nothing wrong, and judged on the rest. Then variants are added one at a time,
the best first, for as long as the error of the rest falls block by block beyond chance; one with
fewer parameters also where it does as well. Of a group one may take another's place.
"""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.equations import Model, check_variants, excludes
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import (
    Data,
    along_motion,
    from_residual,
    goes_along_motion,
    prepare,
    quiet_scale,
)
from rigwatch.workbench.fit import Fitted, fit_model, loosened, with_hold
from rigwatch.workbench.ranking import STEP, Progress, difference, unheard
from rigwatch.workbench.study import Study, check_data, commit, use_variants, varied

FIT_SHARE = 0.6
"""Share of a single healthy recording that is fitted; the rest decides."""
WORTH = 0.02
"""Share by which it must fall for more parameters."""
AS_WELL = 0.002
"""Share by which it may rise for fewer."""
HOPELESS = 1.1
"""Error over that without it from which a variant is not tried beside others."""
ROUNDS = 4
"""Variants that are added at most."""

NO_HEALTHY = (
    "found no healthy recording, expected one: record a run with nothing wrong and list it under"
    " [[healthy]] in the study"
)


@dataclass(frozen=True)
class Base:
    """The study's model with some variants, on the healthy recordings.

    Attributes:
        variants: their names; none is the model as it was written.
        train_error, held_out_error: over all channels, in deviations of the sensors' noise.
        over_noise: the held-out error over what noise leaves there.
        parameters: how many were fitted.
        reason: in words.
    """

    variants: tuple[str, ...]
    train_error: float
    held_out_error: float
    over_noise: float
    parameters: int
    reason: str


@dataclass(frozen=True)
class Bases:
    """What the healthy recordings say of the variants.

    Attributes:
        enough: the base with which nothing better was found, and the simplest of equals.
        ranking: all that were tried, the best first.
        remarks: what was noticed, for people.
    """

    enough: Base
    ranking: list[Base]
    remarks: list[str]


@dataclass(frozen=True, eq=False)
class _Tried:
    base: Base
    fitted: Fitted
    model: Model


def find_base(study: Study, progress: Progress = unheard) -> Bases:
    """Variants of the study's model that its healthy recordings speak for.

    Args:
        study: the study; what it has accepted so far plays no part.
        progress: told which fit begins.

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
    search = _Search(varied(study, ()).with_effects(()), _apart(data.healthy, data.horizon))
    progress("fitting the model as it was written")
    best = search.first()
    tried = [best]
    for _ in range(ROUNDS):
        wished = _next(study.model, best, search.hopeless)
        found = [search.attempt(best, names, progress) for names in wished]
        fits = [one for one in found if one is not None]
        tried += fits
        better = [one for one in fits if _improves(best, one)]
        if not better:
            break
        best = min(better, key=lambda one: one.base.held_out_error)
    ranking = sorted((one.base for one in tried), key=lambda base: base.held_out_error)
    return Bases(best.base, ranking, list(search.remarks))


def take_base(study: Study, variants: Sequence[str]) -> Study:
    """The study with these variants in its file and a line in its ledger.

    Raises:
        ModelError: effects have been accepted on another base, or variants exclude each other.
    """
    if study.file.effects:
        label = f"{study.file.effects[-1].effect}@{study.file.effects[-1].port}"
        raise ModelError(
            f"{study.folder}: found {label} accepted on the base as it is, expected a study without"
            " effects; `rigwatch undo` takes them away"
        )
    varied(study, variants)
    changed = use_variants(study, variants)
    commit(study, changed, "base", variants=list(variants), before=list(study.file.variants))
    return changed


def _next(model: Model, at: _Tried, hopeless: Container[str]) -> list[tuple[str, ...]]:
    """What may be tried from a base: one variant more, or in the place of those it excludes."""
    own = at.base.variants
    return [
        (*(n for n in own if not excludes(model, name, n)), name)
        for name in model.variants
        if name not in own and name not in hopeless
    ]


def _improves(best: _Tried, one: _Tried) -> bool:
    """Whether a base does better beyond chance, or as well with fewer parameters."""
    found = difference(best.fitted.held_out, one.fitted.held_out)
    if one.base.parameters < best.base.parameters and found.relative > -AS_WELL:
        return True
    return found.p_falls < STEP and found.relative > WORTH


class _Search:
    """Fits of the model with variants to the healthy recordings."""

    def __init__(self, study: Study, data: Data) -> None:
        self._study, self._data = study, data
        self._known: dict[frozenset[str], _Tried | None] = {}
        self.remarks: tuple[str, ...] = ()
        self.hopeless: set[str] = set()

    def first(self) -> _Tried:
        """The model as it was written."""
        return self._fitted((), self._study.file.start, "the model as it was written")

    def attempt(self, at: _Tried, names: tuple[str, ...], progress: Progress) -> _Tried | None:
        """The model with these variants, from where another base ended; None where it diverges.

        Each set of variants is fitted once.
        """
        key = frozenset(names)
        if key in self._known:
            return None
        progress(f"fitting it with {' and '.join(names)}")
        own = varied(self._study, names).model.parameters
        before, values = at.model.parameters, at.fitted.train.values()
        start = {n: values[n] for n, p in own.items() if n in values and before.get(n) == p}
        try:
            self._known[key] = self._fitted(names, start, _physics(self._study.model, names))
        except ModelError:
            self._known[key] = None
        found = self._known[key]
        if found is None or found.base.held_out_error > HOPELESS * at.base.held_out_error:
            self.hopeless.add(names[-1])
        return found

    def _fitted(self, names: tuple[str, ...], start: Mapping[str, float], reason: str) -> _Tried:
        study, data = varied(self._study, names), self._data
        written = study.model
        if goes_along_motion(study):
            study, data = along_motion(study, data)
        self.remarks = data.remarks
        scale = quiet_scale(data.train)
        study = with_hold(study, data, scale)
        found = fit_model(
            replace(study, model=loosened(study.model)), data, (), start, scale, from_afar=True
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
    """What variants say of the rig."""
    return " ".join(model.variants[name].physics for name in names)


def _overall(rms: FloatArray, scale: FloatArray) -> float:
    return float(np.sqrt(np.mean((rms / scale) ** 2)))


def _apart(healthy: Recording, horizon: int) -> Data:
    """What is fitted and what decides: the last of several recordings, else the end of the one."""
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
