"""The healthy recording beside the training, for parameters that it alone leaves open.

A healthy rig moves as its drive makes it move. Its recording may then not tell a response to the
motion from a response to the drive, and the model is kept at one point of those that describe it
equally well. From there even the effect that is missing leaves a part of the error and has a wrong
strength. A recording with the fault in it moves otherwise, and tells both responses apart if the
effect is the right one.

So the training holds both recordings, the parameters are free and shared, and effects are present
in the first only. Ranking, fits and tests are as in any other study. An effect beside which the
parameters no longer describe the healthy recording is refused: it has made it its own.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.equations import PRESENT, Input, Model
from rigwatch.physics.engine.fit import Recording, apart, joined, with_effects
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted, fit_base, fit_model, with_kept_free
from rigwatch.workbench.ranking import Progress, Ranked
from rigwatch.workbench.study import Kept, Study

AS_BEFORE = 1.05
"""Largest ratio of the healthy recording's error to that of the parameters' own fit to it: the
allowance of the noise floor along a healthy motion."""
TOLD = (
    "parameters of the model that the healthy recording alone leaves open are fitted to it and to"
    " the training together"
)
REFUSED = "the healthy recording is no longer described with it"


def beside_healthy(bench: Bench, progress: Progress) -> Bench | None:
    """The bench with the healthy recording in its training; None if it does not suit the study.

    Args:
        bench: a study without accepted effects, along its measured motion.
        progress: called with a line of text as the fits begin.
    """
    if not _is_suited(bench):
        return None
    progress("fitting what the healthy recording leaves open to it and the training together")
    study, data = _open(bench.study), _together(bench.study.model, bench.data)
    scale = bench.base.train.scale
    healthy = data.of_healthy
    assert healthy is not None
    try:
        base = fit_base(study, data, scale)
        bare = fit_model(study, healthy, (), {}, scale, multi_start=True)
    except ModelError:
        return None
    return Bench(study, data, base, bench.floor, bare)


def describing_healthy(bench: Bench, rows: Sequence[Ranked]) -> list[Ranked]:
    """The rows of a bench of `beside_healthy`; those that spoil its healthy part are refused."""
    assert bench.bare is not None
    most = AS_BEFORE * _size(bench.bare.train.residuals, bench.bare)
    for row in rows:
        if row.accepted and row.fitted is not None and _healthy_error(bench, row.fitted) > most:
            row.accepted, row.reason = False, REFUSED
    return list(rows)


def _is_suited(bench: Bench) -> bool:
    """Whether parameters are kept from a healthy recording that the model runs along."""
    study, data = bench.study, bench.data
    if study.kept is None or bench.bare is None or data.healthy is None:
        return False
    simple = not (study.file.effects or study.model.rough or study.moving())
    return data.along_motion and simple and data.train.thinning is None


def _open(study: Study) -> Study:
    """The study with its kept parameters free, and effects that may be absent."""
    known = tuple(name for name, p in study.model.parameters.items() if p.fixed and p.deviation)
    deviations = np.array([study.model.parameters[name].deviation for name in known])
    free = with_kept_free(study.model)
    presence = Input(unit="1", hold="linear", constant=True)
    model = structs.replace(free, inputs=free.inputs | {PRESENT: presence})
    return replace(study, model=model, kept=Kept(known, np.diag(deviations**2)))


def _together(model: Model, data: Data) -> Data:
    """The recordings, with the healthy one behind the training.

    Both are cut to windows of the length of the shorter, as each window has initial states of its
    own.
    """
    assert data.healthy is not None
    length = min(len(data.train), len(data.healthy))
    both = [
        _with_presence(part, present)
        for recording, present in ((data.train, 1.0), (data.healthy, 0.0))
        for part in apart(recording.stretch(0, len(recording) // length * length))
    ]
    held_out, healthy = (_with_presence(each, 1.0) for each in (data.held_out, data.healthy))
    opened = data.openings and _with_presence(data.openings, 1.0)
    sensors = tuple(replace(each, present=len(model.inputs)) for each in data.motion)
    return replace(
        data, train=joined(both), held_out=held_out, healthy=healthy, horizon=length,
        remarks=(*data.remarks, TOLD), motion=sensors, openings=opened,
    )  # fmt: skip


def _with_presence(recording: Recording, present: float) -> Recording:
    column = np.full((len(recording), 1), present)
    driving = recording.inputs.shape[1] if recording.driving is None else recording.driving
    return replace(recording, inputs=np.hstack([recording.inputs, column]), driving=driving)


def _healthy_error(bench: Bench, fitted: Fitted) -> float:
    """Error of the healthy part of the training, in standard deviations of noise."""
    first = len(with_effects(bench.study.model, bench.data.train))
    residuals = fitted.train.residuals
    return _size(residuals.reshape(-1, residuals.shape[-1])[first:], fitted)


def _size(residuals: FloatArray, fitted: Fitted) -> float:
    return float(np.sqrt(np.nanmean((residuals / fitted.train.scale) ** 2)))
