"""A channel that the log counts the other way than the model.

With an input of the wrong sign the best fit hardly moves: a gain is on its bound at zero, or an
inertia grows without end. Effects then explain parts of what the input does, and one may be named
with confidence. A model that leaves much of what it should predict is therefore fitted once more
with each channel reversed, before anything is ranked.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rigwatch.physics.engine.equations import Input, Output
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.data import Data, parameters_of
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit import fit_model
from rigwatch.workbench.study import told

MUCH = 0.2
"""Error over the spread of an output from which a model may have the wrong sign."""
HALF = 0.5
"""Share of the error's energy, training and held out, that a reversed channel leaves at most."""
SAID = (
    "{name} seems to be counted the other way than in the model: reversed, it leaves {after:.3g} of"
    " {before:.3g} {unit} of what is held out; map the column with the factor -1 (--map"
    " '{channel}=COLUMN * -1 [UNIT]'), or change its sign in the equations"
)


def reversed_channel(bench: Bench) -> Verdict | None:
    """`model_inadequate` if the model leaves much, and half its energy with a channel reversed.

    A rough model has no signs to get wrong, along the measured motion inputs are states, and a
    model to which an effect was added has been asked before.
    """
    asked = bool(bench.study.file.effects)
    signless = bench.data.along_motion or bench.study.model.rough
    if asked or signless or not _leaves_much(bench):
        return None
    base, unit = bench.base, bench.base.told_in
    most = np.sqrt(HALF) * np.array([base.train_error, base.held_out_error])
    found = [(name, own, errors) for name, own, errors in _tried(bench) if np.all(errors <= most)]
    if not found:
        return None
    name, own, errors = min(found, key=lambda each: each[2][0])
    if _went_astray(bench, errors):
        return None
    text = SAID.format(
        name=name, after=told(float(errors[1]), unit), before=told(base.held_out_error, unit),
        unit=unit, channel=own.channel or name,
    )  # fmt: skip
    return Verdict("model_inadequate", None, (), (), text)


def _went_astray(bench: Bench, errors: FloatArray) -> bool:
    """Whether the model leaves as little with no channel reversed, begun from the given values.

    Its own fit has then ended in a local minimum.
    """
    plain = _errors_of(bench, bench.data)
    return plain is not None and not np.all(errors <= np.sqrt(HALF) * plain)


def _leaves_much(bench: Bench) -> bool:
    """Whether much of an output's spread is left."""
    spread = np.nanstd(bench.data.train.outputs, axis=0)
    return bool(np.any(bench.base.train.rms > MUCH * spread))


def _tried(bench: Bench) -> Iterator[tuple[str, Input | Output, FloatArray]]:
    """Name of a reversed channel, the channel, and the training and held-out error with it.

    Outputs are tried where there are several inputs: of one, reversing either is the same.
    """
    model, inputs = bench.study.model, bench.data.train.inputs
    changing = [bool(np.ptp(column)) for column in inputs.T]
    tried: list[tuple[str, Input | Output, str, int]] = [
        (name, own, "inputs", i)
        for i, (name, own) in enumerate(model.inputs.items())
        if changing[i]
    ]
    if len(tried) > 1:
        tried += [(name, own, "outputs", i) for i, (name, own) in enumerate(model.outputs.items())]
    for name, own, side, column in tried:
        errors = _errors_of(bench, _reversed(bench.data, side, column))
        if errors is not None:
            yield name, own, errors


def _errors_of(bench: Bench, data: Data) -> FloatArray | None:
    """Training and held-out error of the model on other data; None if it cannot be fitted."""
    study, scale = bench.study, bench.base.train.scale
    try:
        found = fit_model(study, data, (), parameters_of(study.file), scale)
    except RigwatchError:
        return None
    return np.array([found.train_error, found.held_out_error])


def _reversed(data: Data, side: str, column: int) -> Data:
    """The training and held-out recordings with one channel of the other sign."""

    def turned(recording: Recording) -> Recording:
        channels = getattr(recording, side).copy()
        channels[:, column] *= -1
        return replace(recording, **{side: channels})

    opening = data.openings and turned(data.openings)
    return replace(data, train=turned(data.train), held_out=turned(data.held_out), openings=opening)
