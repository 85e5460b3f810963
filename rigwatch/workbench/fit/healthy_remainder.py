"""A rough model along the measured motion, extended by terms learned from a healthy rig.

A free simulation of a rough model, such as a linear black box, drifts and leaves a large residual.
Driven by the measured motion, the model only predicts the force balance (see `measured_motion`),
where a missing force appears at once, for any excitation. Its remaining residual on a healthy rig
is learned from the healthy recordings, as a function of the motion and of hidden states that follow
it (`term_selection.py`).

All parameters are then fixed, so a fit to another recording cannot absorb a fault. The recordings
need neither a common period nor a common excitation; motion beyond the healthy range is reported.
"""

from dataclasses import replace

from msgspec import structs

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, along_motion, repeat_of
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.healthy_parameters import with_known
from rigwatch.workbench.fit.intervals import covariance
from rigwatch.workbench.fit.learned_terms import LEARNED
from rigwatch.workbench.fit.term_selection import Learned, learn_terms
from rigwatch.workbench.study import Kept, Study

LONGER = 4
"""Ratio of window lengths along the motion to the study's: runs do not drift, and hidden states
need to settle only once."""
SUBSTEPS = 4
"""Integration steps per sample: the hidden states are as fast as a valve."""


def with_healthy_remainder(study: Study, data: Data) -> tuple[Study, Data]:
    """The study with its rough model extended by learned terms, and its recordings.

    Args:
        study: as opened.
        data: its recordings.

    Raises:
        ModelError: there is no healthy recording, or none of the model's states is measured.
    """
    name = study.model.name
    if data.healthy is None:
        raise ModelError(
            f"{name}: found no healthy recording, expected one, as this model learns its terms from"
            " it"
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
    found = learn_terms(study, healthy, driven.horizon)
    kept = tuple(found.fitted.compiled.system.free)
    uncertain = covariance(found.fitted.train, repeat_of(healthy))[0]
    kept_parameters = Kept(kept, uncertain, found.fitted.convergence)
    alone = replace(driven, train=healthy, held_out=healthy, healthy=None)
    kept_parameters = with_known(kept_parameters, alone, found.fitted)
    # The start values have been used; they must not overwrite the learned parameters.
    file = structs.replace(study.file, start={})
    study = replace(study, file=file, model=_fixed(found.model, found.fitted), kept=kept_parameters)
    return study, replace(driven, remarks=(*driven.remarks, _remark(name, found)))


def _fixed(model: Model, fitted: Fitted) -> Model:
    """The model with the values of a fit, all fixed."""
    values = fitted.train.values()
    parameters = {
        name: structs.replace(p, value=values[name], fixed=True)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)


def _remark(name: str, found: Learned) -> str:
    more = f", with {' and '.join(found.steps)}" if found.steps else ""
    count = sum(n.startswith(LEARNED) for n in found.fitted.compiled.system.free)
    return (
        f"{name}: learned along the measured motion of the healthy recording{more}"
        f" ({count} terms); it leaves {found.fitted.train_error:.3g} there"
    )
