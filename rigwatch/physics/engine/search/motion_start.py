"""Initial values of a fit over windows, from the model along its measured motion.

Where channels measure some of a model's states, the others are free in every window, and from far
values the search over the parameters meets many minima and simulations that diverge. Driven by the
measured motion the same equations are one stable run, whose error varies smoothly over decades of
the parameters (see `whole_runs.py`). It ends near the optimum of the windows in a fraction of their
time. What the outputs do not show, as the mean of an acceleration that an AC-coupled sensor takes
away, is left to the fit over windows, and so is the noise of the motion.
"""

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import (
    along_measured_motion,
    compose,
    has_hidden_states,
    predicted_outputs,
)
from rigwatch.physics.engine.fit import Recording, motion_recording
from rigwatch.physics.engine.search.whole_runs import WholeRuns
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

SETTLING = 0.1
"""Share of the shortest part of a recording in which hidden states settle; at most `LONGEST`."""
LONGEST = 1.0
"""Longest time for that [s]."""


def motion_start(
    compiled: CompiledSystem,
    recording: Recording,
    begin: FloatArray,
    noise: FloatArray,
    substeps: int,
) -> FloatArray | None:
    """All parameters where the search along the measured motion ends, shape (n_p,).

    Args:
        compiled: the system. Effects at sensors of the motion keep their values.
        recording: the recording to fit.
        begin: initial values of all parameters, shape (n_p,).
        noise: of the sensors, shape (outputs,).
        substeps: Runge-Kutta steps between samples.

    Returns:
        None if channels measure none or all of the states, no output is left to predict, or the
        search diverges.
    """
    system, model = compiled.system, compiled.system.model
    kept = predicted_outputs(model) if has_hidden_states(model) else ()
    if not kept or not system.free:
        return None
    along = along_measured_motion(model)
    placed = [each for each in system.placements if each.port in along.ports]
    shown = [list(model.outputs).index(name) for name in kept]
    shortest = min(recording.parts or (len(recording),)) * recording.dt
    values = dict(zip(system.parameters, begin.tolist(), strict=True))
    try:
        driven = compile_system(compose(along, placed))
        motion = motion_recording(model, recording, settling=min(LONGEST, SETTLING * shortest))
        own = driven.vector({name: values[name] for name in driven.system.parameters})
        search = WholeRuns(driven, [motion], noise[shown], start=own, substeps=substeps)
        found, _ = search.first_search()
    except ModelError:
        return None
    return np.array([found.get(name, value) for name, value in values.items()])
