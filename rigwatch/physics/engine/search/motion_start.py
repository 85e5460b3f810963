"""Initial values of a fit over windows, from the model along its measured motion.

Where channels measure some of a model's states, the others are free in every window, and from far
values the search over the parameters meets many minima and simulations that diverge. Driven by the
measured motion the same equations are one stable run, whose error varies smoothly over decades of
the parameters (see `whole_runs.py`). It ends near the optimum of the windows in a fraction of their
time.

An output need not show all of a balance: an AC-coupled accelerometer takes away the mean, and a
force that is constantly wrong would throw every window off. The rates of the measured motion itself
are therefore predicted too, each only as well as its own size: that holds what is slow and leaves
the rest to the outputs.
"""

from dataclasses import replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import (
    Model,
    Output,
    along_measured_motion,
    balanced_states,
    compose,
    has_hidden_states,
    predicted_outputs,
)
from rigwatch.physics.engine.fit import Recording, motion_rates, motion_recording
from rigwatch.physics.engine.search.whole_runs import WholeRuns
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

SETTLING = 0.1
"""Share of the shortest part of a recording in which hidden states settle; at most `LONGEST`."""
LONGEST = 1.0
"""Longest time for that [s]."""
RATE = "rate_of_"
"""Prefix of the outputs that are rates of the motion."""


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
    along = _with_rates(along_measured_motion(model), model)
    placed = [each for each in system.placements if each.port in along.ports]
    shown = [list(model.outputs).index(name) for name in kept]
    shortest = min(recording.parts or (len(recording),)) * recording.dt
    values = dict(zip(system.parameters, begin.tolist(), strict=True))
    try:
        driven = compile_system(compose(along, placed))
        motion = motion_recording(model, recording, settling=min(LONGEST, SETTLING * shortest))
        rates = motion_rates(model, recording)
        rates[np.isnan(motion.outputs).all(axis=1)] = np.nan
        motion = replace(motion, outputs=np.column_stack([motion.outputs, rates]))
        sizes = np.concatenate([noise[shown], _sizes(rates)])
        own = driven.vector({name: values[name] for name in driven.system.parameters})
        search = WholeRuns(driven, [motion], sizes, start=own, substeps=substeps)
        found, _ = search.first_search()
    except ModelError:
        return None
    return np.array([found.get(name, value) for name, value in values.items()])


def _sizes(rates: FloatArray) -> FloatArray:
    """Root mean square of each column; 1 without any size."""
    found = np.sqrt(np.mean(np.nan_to_num(rates) ** 2, axis=0))
    return np.where(found > 0, found, 1.0)


def _with_rates(along: Model, model: Model) -> Model:
    """The model along its motion, with the rates of the motion as further outputs."""
    rates = {
        RATE + state.name: Output(
            unit=f"({model.states[state.name].unit})/s",
            expression=model.states[state.name].derivative,
        )
        for state in balanced_states(model)
    }
    return structs.replace(along, outputs=along.outputs | rates)
