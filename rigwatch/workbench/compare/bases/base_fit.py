"""A base of a study, fitted to the first part of its healthy recordings and judged on the rest."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import compose
from rigwatch.physics.engine.fit import Fit, beginning, evaluate
from rigwatch.physics.engine.search import WholeRuns, multi_start_fit
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import (
    Data,
    along_motion,
    from_residual,
    predicts_along_motion,
    quiet_scale,
)
from rigwatch.workbench.fit import Fitted, fit_model, with_hold, with_kept_free
from rigwatch.workbench.study import Element, Study, elements_of, physics_of, written_variants

PART = 2048
"""Samples of the healthy recording to which bases are fitted briefly."""


@dataclass(frozen=True)
class Base:
    """The study's model with some variants, fitted to the healthy recordings.

    Attributes:
        variants: their names, and elements as `effect@port(values)`; none is the unmodified model.
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


@dataclass(frozen=True, eq=False)
class Tried:
    """A base with its fit; `study` has it in its model, not along the motion.

    `along` and `data` are what was fitted: the study with its parameters free, and its recordings.
    """

    base: Base
    fitted: Fitted
    study: Study
    along: Study
    data: Data


@dataclass(frozen=True, eq=False)
class Brief:
    """A base after a brief fit to the beginning of the recording along the motion.

    `error` is in noise standard deviations; the rest as in `Tried`.
    """

    fit: Fit
    error: float
    study: Study
    along: Study
    data: Data


def fitted_base(study: Study, data: Data, start: Mapping[str, float]) -> Tried:
    """The base fitted from these values.

    Args:
        study: the base, in its model.
        data: its healthy recordings, the first part as training, for the unmodified model.
        start: initial values by name, in SI.

    Raises:
        ModelError: it cannot be fitted.
    """
    along, used, scale = _prepared(study, data)
    found = fit_model(along, used, (), start, scale, multi_start=True)
    return _judged(study, along, used, scale, found)


def brief_fit(study: Study, data: Data, start: Mapping[str, float]) -> Brief:
    """The base fitted briefly along the motion, see `fitted_base`.

    Raises:
        ModelError: it cannot be fitted.
    """
    along, used, scale = _prepared(study, data)
    compiled, part = compile_system(compose(along.model, ())), beginning(used.train, PART)
    search = WholeRuns(
        compiled, [part], scale, start=compiled.vector(start), substeps=study.file.substeps,
        brief=True,
    )  # fmt: skip
    found, _ = multi_start_fit(search)
    return Brief(found, _overall(found.rms, scale), study, along, used)


def judged(brief: Brief) -> Tried:
    """A briefly fitted base, judged as the others on all of the recordings."""
    used, substeps = brief.data, brief.study.file.substeps
    train, held_out = (
        evaluate(brief.fit, recording, len(recording), substeps)
        for recording in (used.train, used.held_out)
    )
    found = Fitted((), train, held_out, substeps, used.horizon)
    return _judged(brief.study, brief.along, used, brief.fit.scale, found)


def _judged(study: Study, along: Study, used: Data, scale: FloatArray, found: Fitted) -> Tried:
    """A fitted base with its errors."""
    noise = from_residual(found.held_out, used.held_out, study.file.period, used.horizon)
    base = Base(
        _with_values(study, found.train.values()),
        _overall(found.train.rms, scale),
        _overall(found.held_out.rms, scale),
        noise.ratio(found.held_out),
        len(found.compiled.system.free),
        " ".join(physics_of(study, name) for name in study.file.variants),
    )
    return Tried(base, found, study, along, used)


def shared_values(study: Study, fit: Fit, other: Study) -> dict[str, float]:
    """Fitted values of a base for the parameters that another has with the same meaning.

    Args:
        study: the base.
        fit: its fit.
        other: the other base.
    """
    before, values, own = study.model.parameters, fit.values(), other.model.parameters
    return {n: values[n] for n, p in own.items() if n in values and before.get(n) == p}


def _prepared(study: Study, data: Data) -> tuple[Study, Data, FloatArray]:
    if predicts_along_motion(study):
        study, data = along_motion(study, data)
    scale = quiet_scale(data.train)
    study = with_hold(study, data, scale)
    return replace(study, model=with_kept_free(study.model)), data, scale


def _with_values(study: Study, values: Mapping[str, float]) -> tuple[str, ...]:
    """The base's variants, with the fitted values of its elements."""
    names = study.file.variants
    told = [_told(study, element, values) for element in elements_of(names)]
    return (*written_variants(names), *map(str, told))


def _told(study: Study, element: Element, values: Mapping[str, float]) -> Element:
    known = study.model.parameters
    named = {name: element.prefix + name for name in study.effect(element.effect).parameters}
    kept = {name: whole for name, whole in named.items() if whole in known and known[whole].kept}
    return replace(element, values={name: values[kept[name]] for name in sorted(kept)})


def _overall(rms: FloatArray, scale: FloatArray) -> float:
    return float(np.sqrt(np.mean((rms / scale) ** 2)))
