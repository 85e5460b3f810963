"""Begins windows at rest where the machine rests.

A fit gives a hidden state, as a motor's current, any value at the beginning of a window if that
leaves a little less. A machine that stands still, with constant inputs, then creeps in the model;
how fast hardly matters, but which way decides the direction of dry friction, which a score takes
from the model's motion. Such a window begins where the model rests as well, if there is such a
state that reads what was measured:

    x = Φ(x), Φ: the states some samples later

by Newton's method, from the states of the fit.
"""

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, Simulation
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray

OPENING = 5
"""Samples at the beginning of a window in which nothing may change."""
STILL = 0.02
"""Change over the spread of an output, up to which it stands still, and reads what rests."""
STEPS = 8
"""Most steps of Newton's method; a linear model takes one."""


def begun_at_rest(
    compiled: CompiledSystem,
    recording: Recording,
    starts: IntArray,
    *,
    initial: FloatArray,
    parameters: FloatArray,
    substeps: int,
) -> FloatArray:
    """The initial states of windows, of those that begin at rest the model's own, (windows, n).

    Args:
        compiled: the model.
        recording: its recording.
        starts: first sample of each window, shape (windows,).
        initial: states at the beginnings of windows, shape (windows, n).
        parameters: all of them, shape (n_p,).
        substeps: steps between samples.
    """
    spread = np.nanstd(recording.outputs, axis=0)
    resting = np.flatnonzero(_stand_still(recording, starts, spread))
    if not len(resting) or not compiled.system.states:
        return initial
    states = initial[resting]

    def run_from(states: FloatArray) -> Simulation:
        return compiled.simulate(
            recording.inputs, recording.spacing, starts[resting], OPENING,
            initial=states, parameters=parameters, substeps=substeps, begins=recording.begins,
            time=recording.time,
        )  # fmt: skip

    for _ in range(STEPS):
        run = run_from(states)
        slopes = run.last_slopes[..., len(compiled.system.free) :] - np.eye(states.shape[1])
        if not (np.isfinite(slopes).all() and np.isfinite(run.last).all()):
            return initial
        steps = [np.linalg.lstsq(a, b)[0] for a, b in zip(slopes, run.last - states, strict=True)]
        states = states - np.array(steps)
    run = run_from(states)
    measured = recording.outputs[starts[resting, None] + np.arange(OPENING)]
    rests = (np.abs(run.outputs - measured) <= STILL * spread).all(axis=(1, 2))
    found = initial.copy()
    found[resting[rests]] = states[rests]
    return found


def _stand_still(recording: Recording, starts: IntArray, spread: FloatArray) -> BoolArray:
    """Whether inputs and outputs do not change at the beginning of each window."""
    rows = starts[:, None] + np.arange(OPENING)
    inside = rows[:, -1] < len(recording)
    rows = np.minimum(rows, len(recording) - 1)
    inputs = np.ptp(recording.inputs[rows], axis=1)
    outputs = np.ptp(recording.outputs[rows], axis=1)
    same = recording.begins[rows[:, 0]] == recording.begins[rows[:, -1]]
    still = (inputs == 0.0).all(axis=1) & (outputs <= STILL * spread).all(axis=1)
    return np.asarray(inside & same & still)
