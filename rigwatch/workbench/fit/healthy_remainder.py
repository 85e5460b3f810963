"""A rough model along the measured motion, with what a healthy rig does beyond it learned.

A rough model, such as a linear black box, drifts and leaves much when it is simulated on its own.
Driven by the measured motion it predicts the force balance alone (see `measured_motion`), and a
missing force shows there at once, whatever the excitation. What it still leaves of a healthy rig
is learned from the healthy recordings as a function of the motion and of hidden states that follow
it (`learning.py`).

Then all of it is fixed, so that a fit to another recording cannot swallow a fault. The recordings
need no common period and no common excitation; but motion beyond the healthy one is said.
"""

from dataclasses import replace

from msgspec import structs

from rigwatch.physics.engine.equations import Model, has_hidden_states
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, along_motion
from rigwatch.workbench.fit.fitted_model import Fitted
from rigwatch.workbench.fit.healthy_parameters import with_known
from rigwatch.workbench.fit.intervals import covariance
from rigwatch.workbench.fit.learned_terms import LEARNED
from rigwatch.workbench.fit.learning import Learned, learn
from rigwatch.workbench.study import Kept, Study

LONGER = 4
"""Windows along the motion over the study's: nothing drifts, and hidden states settle once."""
SUBSTEPS = 4
"""Integration steps a sample at least: the hidden states are as fast as a valve."""


def learns_from_healthy(study: Study) -> bool:
    """Whether a study's model is rough and learns along the measured motion what it leaves."""
    if study.file.prediction != "auto":
        return False
    return study.model.rough and has_hidden_states(study.model)


def with_healthy_remainder(study: Study, data: Data) -> tuple[Study, Data]:
    """The study's rough model along the measured motion, with its remainder, and its recordings.

    Args:
        study: as it was opened.
        data: its recordings.

    Raises:
        ModelError: there is no healthy recording, or none of the model's states is measured.
    """
    name = study.model.name
    if data.healthy is None:
        raise ModelError(
            f"{name}: found no healthy recording, expected one, as this model learns from it what a"
            " healthy rig does"
        )
    horizon = LONGER * data.horizon
    study, driven = along_motion(study, data)
    healthy = driven.healthy
    assert healthy is not None
    every = (driven.train, driven.held_out, healthy)
    lengths = [n for recording in every for n in recording.parts or (len(recording),)]
    whole = all(length % horizon == 0 for length in lengths)
    driven = replace(driven, horizon=horizon if whole else data.horizon)
    study = replace(study, file=structs.replace(study.file, substeps=SUBSTEPS))
    found = learn(study, healthy, driven.horizon)
    kept = tuple(found.fitted.compiled.system.free)
    told = Kept(kept, covariance(found.fitted.train)[0], found.fitted.convergence)
    alone = replace(driven, train=healthy, held_out=healthy, healthy=None)
    told = with_known(told, alone, found.fitted)
    # What the file says to start from has been used, and must not move what was learned.
    file = structs.replace(study.file, start={})
    study = replace(study, file=file, model=_fixed(found.model, found.fitted), kept=told)
    return study, replace(driven, remarks=(*driven.remarks, _said(name, found)))


def _fixed(model: Model, fitted: Fitted) -> Model:
    """The model with the values of a fit, none of them free any more."""
    values = fitted.train.values()
    parameters = {
        name: structs.replace(p, value=values[name], fixed=True)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)


def _said(name: str, found: Learned) -> str:
    more = f", with {' and '.join(found.steps)}" if found.steps else ""
    count = sum(n.startswith(LEARNED) for n in found.fitted.compiled.system.free)
    return (
        f"{name}: learned along the measured motion of the healthy recording{more}"
        f" ({count} terms); it leaves {found.fitted.train_error:.3g} there"
    )
