"""An input that the log counts the other way than the model.

With an input of the wrong sign the best fit hardly moves: a gain is on its bound at zero, or an
inertia grows without end. Effects then explain parts of what the input does, and one may be named
with confidence. A model that leaves much of what it should predict is therefore fitted once more
with each input reversed, before anything is ranked.
"""

from dataclasses import replace

import numpy as np

from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import Data
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit import fit_base
from rigwatch.workbench.study import told

MUCH = 0.2
"""Error over the spread of an output from which a model may have the wrong sign."""
HALF = 0.5
"""Share of the error's energy that a reversed input may leave at most, of training and held out."""
SAID = (
    "{name} seems to be counted the other way than in the model: reversed, it leaves {after:.3g} of"
    " {before:.3g} {unit} of what is held out; map the column with the factor -1 (--map"
    " '{channel}=COLUMN * -1 [UNIT]'), or change its sign in the equations"
)


def reversed_input(bench: Bench) -> Verdict | None:
    """`model_inadequate` if the model leaves much, and half its energy with an input reversed.

    A rough model has no signs to get wrong, and along the measured motion inputs are states.
    """
    if bench.data.along_motion or bench.study.model.rough or not _leaves_much(bench):
        return None
    base, unit = bench.base, bench.base.told_in
    most = np.sqrt(HALF) * np.array([base.train_error, base.held_out_error])
    for column, (name, own) in enumerate(bench.study.model.inputs.items()):
        errors = _errors_with(bench, column)
        if errors is not None and np.all(errors <= most):
            text = SAID.format(
                name=name, after=told(float(errors[1]), unit),
                before=told(base.held_out_error, unit), unit=unit,
                channel=own.channel or name,
            )  # fmt: skip
            return Verdict("model_inadequate", None, (), (), text)
    return None


def _leaves_much(bench: Bench) -> bool:
    """Whether much of an output's spread is left."""
    spread = np.nanstd(bench.data.train.outputs, axis=0)
    return bool(np.any(bench.base.train.rms > MUCH * spread))


def _errors_with(bench: Bench, column: int) -> FloatArray | None:
    """Training and held-out error with one input reversed; None if that says nothing.

    One that does not change, or not fit, does not.
    """
    if not np.ptp(bench.data.train.inputs[:, column]):
        return None
    data, scale = _reversed(bench.data, column), bench.base.train.scale
    try:
        found = fit_base(bench.study, data, scale, multi_start=True)
    except RigwatchError:
        return None
    return np.array([found.train_error, found.held_out_error])


def _reversed(data: Data, column: int) -> Data:
    """The training and held-out recordings with one input of the other sign."""

    def turned(recording: Recording) -> Recording:
        inputs = recording.inputs.copy()
        inputs[:, column] *= -1
        return replace(recording, inputs=inputs)

    opening = data.openings and turned(data.openings)
    return replace(data, train=turned(data.train), held_out=turned(data.held_out), openings=opening)
