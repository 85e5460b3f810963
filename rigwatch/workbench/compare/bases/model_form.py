"""Model form: how much a strength depends on laws of the base model that the data leave open.

A model file offers variants of its laws: of the flow, the valve, the heat, the sensors. Those that
describe the healthy recording about as well as the base could as well be the machine's, and each
gives another strength. The base and, one at a time, the base with each variant are therefore fitted
to the beginning of the healthy recording, and the effect is fitted again with each. The largest
difference from the base within a group of variants is a standard deviation of the strength; groups
are independent and add in quadrature (JCGM 100:2008 (GUM), 5.1).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compile import compile_system, side_by_side
from rigwatch.physics.engine.equations import (
    Model,
    along_measured_motion,
    compose,
    is_level_known,
    unmoved_at_rest,
)
from rigwatch.physics.engine.fit import Recording, beginning
from rigwatch.physics.engine.search import WholeRuns
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.compare.bases.base_fit import PART
from rigwatch.workbench.compare.bases.base_neighbours import with_one_variant_more
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted, values_with, with_kept_free, with_values
from rigwatch.workbench.study import Study, varied

AS_GOOD = 1.1
"""Largest ratio of the errors on the healthy recording at which a variant counts."""


def variances_between_bases(
    study: Study, data: Data, bare: Fitted | None, fitted: Fitted
) -> dict[str, float]:
    """Variances of the fitted parameters between bases that the healthy recording allows, by name.

    Args:
        study: prepared, with parameters from the healthy recording.
        data: its recordings along the measured motion.
        bare: the model alone, fitted to the healthy recording.
        fitted: the model with some effects.
    """
    healthy = data.of_healthy
    if bare is None or healthy is None or not (fitted.placements and study.model.variants):
        return {}
    part, own = beginning(healthy.train, PART), study.file.variants
    every = [own, *with_one_variant_more(study)]
    moved: dict[str, FloatArray] = {}
    try:
        known = with_kept_free(_along(study, own))
    except RigwatchError:
        return {}
    base, *others = side_by_side(lambda names: _tried(study, names, part, bare, known), every)
    if base is None:
        return {}
    good = [each for each in others if each is not None and each.error <= AS_GOOD * base.error]
    before, *after = side_by_side(
        lambda each: _strengths(study, data, each.model, fitted), [base, *good]
    )
    if before is None:
        return {}
    for other, strengths in zip(good, after, strict=True):
        if strengths is not None:
            group = study.model.variants[other.names[-1]].group or other.names[-1]
            moved[group] = np.fmax(moved.get(group, 0.0), (strengths - before) ** 2)
    total = np.sum([np.zeros_like(before), *moved.values()], axis=0)
    return dict(zip(fitted.compiled.system.free, total.tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class _Tried:
    """A base: its variants, the model with the parameters of a healthy recording, the error."""

    names: Sequence[str]
    model: Model
    error: float


def _tried(
    study: Study, names: Sequence[str], healthy: Recording, bare: Fitted, known: Model
) -> _Tried | None:
    """The base with these variants, searched from the values it shares with the study's.

    Args:
        study: prepared, with parameters from the healthy recording.
        names: of the variants.
        healthy: what it is fitted to.
        bare: the study's base, fitted to the healthy recording.
        known: that base as its file has it.
    """
    try:
        model = _along(study, names)
        loose = with_kept_free(model)
        shared = [n for n, p in loose.parameters.items() if known.parameters.get(n) == p]
        compiled = compile_system(compose(loose, ()))
        start = compiled.vector({n: study.model.parameters[n].value for n in shared})
        scale, steps = bare.train.scale, study.file.substeps
        search = WholeRuns(compiled, [healthy], scale, start=start, substeps=steps, brief=True)
        values, error = search.first_search()
    except RigwatchError:
        return None
    return _Tried(names, with_values(model, values), error)


def _along(study: Study, names: Sequence[str]) -> Model:
    """The model with these variants along the measured motion, with the study's sensors, holds."""
    known = study.model.parameters
    held = unmoved_at_rest(varied(study, names).model, level_known=is_level_known(study.model))
    model = along_measured_motion(held)
    sensors = [n for o in model.outputs.values() for n in (o.late, o.corner) if n in known]
    parameters = model.parameters | {n: known[n] for n in sensors if not known[n].kept}
    return structs.replace(model, inputs=study.model.inputs, parameters=parameters)


def _strengths(study: Study, data: Data, model: Model, fitted: Fitted) -> FloatArray | None:
    """The fitted parameters with another base, NaN of those that it lacks, shape (m,).

    None if they cannot be fitted.
    """
    prefixes = tuple(placement.prefix for placement in fitted.placements)
    start = {n: v for n, v in fitted.train.values().items() if n.startswith(prefixes)}
    other, scale = replace(study, model=model, kept=None), fitted.train.scale
    try:
        found = values_with(other, data, fitted.placements, start, scale)
    except RigwatchError:
        return None
    return np.array([found.get(name, np.nan) for name in fitted.compiled.system.free])
