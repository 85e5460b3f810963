"""A base of a study, fitted to the first part of its healthy recordings and judged on the rest."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.physics.engine.fit import beginning, evaluate
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.brief_fits import Brief, Posed, posed
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
class PosedBase:
    """A base along the motion before a brief fit; `search` is None if it cannot be simulated."""

    study: Study
    along: Study
    data: Data
    scale: FloatArray
    search: Posed | None


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


def briefly_fitted(posed: PosedBase, brief: Brief) -> Tried:
    """The base as a brief fit to the beginning of the recording leaves it, judged as the others."""
    used, substeps = posed.data, posed.study.file.substeps
    train, held_out = (
        evaluate(brief.fit, recording, len(recording), substeps)
        for recording in (used.train, used.held_out)
    )
    found = Fitted((), train, held_out, substeps, used.horizon, None, brief.ended)
    return _judged(posed.study, posed.along, used, posed.scale, found)


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


def posed_base(study: Study, data: Data, start: Mapping[str, float]) -> PosedBase:
    """A brief search for the base's parameters along the motion, see `fitted_base`."""
    along, used, scale = _prepared(study, data)
    part = beginning(used.train, PART)
    search = posed(along.model, part, scale, start, study.file.substeps)
    return PosedBase(study, along, used, scale, search)


def shared_values(at: Tried, other: Study) -> dict[str, float]:
    """Fitted values of one base for the parameters that another has with the same meaning."""
    before, values = at.study.model.parameters, at.fitted.train.values()
    own = other.model.parameters
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
    prefix = f"healthy_{element.port}_{element.effect}_"
    own = {n for n, p in study.model.parameters.items() if p.kept and n.startswith(prefix)}
    return replace(element, values={n[len(prefix) :]: values[n] for n in sorted(own)})


def _overall(rms: FloatArray, scale: FloatArray) -> float:
    return float(np.sqrt(np.mean((rms / scale) ** 2)))
