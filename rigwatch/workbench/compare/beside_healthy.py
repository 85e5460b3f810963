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

from dataclasses import replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.equations import PRESENT, Input, Model
from rigwatch.physics.engine.fit import Recording, apart, joined
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import with_kept_free
from rigwatch.workbench.study import Kept, Study

TOLD = (
    "parameters of the model that the healthy recording alone leaves open are fitted to it and to"
    " the training together"
)


def may_share(study: Study, data: Data) -> bool:
    """Whether a study keeps parameters from a healthy recording that its model runs along."""
    if study.kept is None or data.healthy is None or study.model.presence is not None:
        return False
    simple = not (study.model.rough or study.moving()) and data.train.thinning is None
    return data.along_motion and simple


def was_accepted_so(study: Study) -> bool:
    """Whether the last effect was accepted with parameters from both recordings.

    Then they are kept with it: those from the healthy recording alone never are.
    """
    kept = {name for name, p in study.model.parameters.items() if p.kept}
    return bool(study.file.effects) and not kept.isdisjoint(study.file.effects[-1].model)


def shared(study: Study, data: Data) -> tuple[Study, Data]:
    """A study that `may_share`, its kept parameters free, with both recordings in the training."""
    known = tuple(name for name, p in study.model.parameters.items() if p.fixed and p.deviation)
    deviations = np.array([study.model.parameters[name].deviation for name in known])
    free = with_kept_free(study.model)
    presence = Input(unit="1", hold="linear", constant=True)
    model = structs.replace(free, inputs=free.inputs | {PRESENT: presence})
    kept = Kept(known, np.diag(deviations**2))
    return replace(study, model=model, kept=kept), _together(study.model, data)


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
