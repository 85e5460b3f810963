"""The states of a model as it simulates them, of which channels show no more than a part."""

from collections.abc import Mapping

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Model, Output, compose
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray


def simulated_states(
    model: Model,
    recording: Recording,
    values: Mapping[str, float],
    *,
    initial: FloatArray,
    substeps: int = 4,
) -> FloatArray:
    """The model's states in one run along a recording, shape (n, states).

    Args:
        model: its effects are left out, and what its sensors do.
        recording: drives it.
        values: of its parameters, by name.
        initial: states at the first sample, shape (states,).
        substeps: Runge-Kutta steps between samples.
    """
    parameters = {
        name: structs.replace(p, value=values[name], fixed=True, kept=False)
        for name, p in model.parameters.items()
    }
    ports = {name: port for name, port in model.ports.items() if port.kind != "sensor"}
    outputs = {name: Output(unit=s.unit, expression=name) for name, s in model.states.items()}
    shown = structs.replace(model, parameters=parameters, ports=ports, outputs=outputs)
    compiled = compile_system(compose(shown))
    run = compiled.simulate(
        recording.inputs, recording.spacing, np.zeros(1, np.int64), len(recording),
        initial=initial[None], parameters=compiled.parameters, substeps=substeps,
        begins=recording.begins, time=recording.time,
    )  # fmt: skip
    return np.asarray(run.outputs[0], np.float64)
