"""Sizes of the signals at each port, to which initial values and bounds of effects are scaled."""

import numpy as np
from scipy.signal import detrend

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.equations import (
    Model,
    Port,
    arriving,
    compose,
    names_in,
    spelt_out,
)
from rigwatch.physics.engine.fit import Recording, initial_states, shown_states
from rigwatch.physics.engine.score import sizes_at_port
from rigwatch.wire.arrays import FloatArray

Sizes = dict[str, float]


def port_sizes(model: Model, recording: Recording) -> dict[str, Sizes]:
    """Root mean square of each port's variables on the recording.

    In addition to the port's own variables there are `dt`, the sample period [s], and, at a signal
    port, `u` and `rate`, the rms of the signal and of its rate of change.
    """
    model = spelt_out(model)
    signals = _measured(model, recording)
    return {name: _sizes(port, model, signals, recording) for name, port in model.ports.items()}


def _measured(model: Model, recording: Recording) -> dict[str, FloatArray]:
    system = compose(model)
    found = dict(zip(model.states, initial_states(system, recording).T, strict=True))
    found |= dict(zip(model.inputs, recording.inputs.T, strict=True))
    found |= dict(zip(model.outputs, recording.outputs.T, strict=True))
    for name in system.ports:
        found[name] = _signal(model.ports[name], model, found)
    return found


def _signal(port: Port, model: Model, signals: dict[str, FloatArray]) -> FloatArray:
    """What arrives at a port, as measured or computed from what is measured; 0 at a force port."""
    if port.kind == "force":
        return np.zeros(len(next(iter(signals.values()))))
    if port.signal in signals:
        return signals[port.signal]
    values = {name: p.value for name, p in model.parameters.items()}
    return evaluated(arriving(model, port), signals, values, f"port signal {port.signal}")


def _sizes(port: Port, model: Model, signals: dict[str, FloatArray], recording: Recording) -> Sizes:
    values = {name: p.value for name, p in model.parameters.items()}
    variables = {
        name: evaluated(variable.expression, signals, values, f"port variable {name}")
        for name, variable in port.variables.items()
    }
    signal = _signal(port, model, signals) if port.signal else None
    if "v" in variables and ("x" not in variables or _is_hidden(port, model)):
        variables["x"] = _travel(variables["v"], recording)
    return sizes_at_port(variables, signal, recording.dt)


def _is_hidden(port: Port, model: Model) -> bool:
    """Whether a port's position is a state that no channel shows, such as the twist of a shaft.

    Before a fit such a state is known at its initial value only, which is not its size.
    """
    system = compose(model)
    shown = shown_states(system)
    hidden = {name for index, name in enumerate(system.states) if index not in shown}
    return bool(names_in(port.variables["x"].expression, "port variable x") & hidden)


def _travel(speed: FloatArray, recording: Recording) -> FloatArray:
    """Displacement: the integral of a speed with its drift removed, shape (n,)."""
    ends = np.cumsum(recording.parts or (len(recording),))[:-1]
    pieces = np.split(np.nan_to_num(speed), ends)
    return np.concatenate([detrend(np.cumsum(piece)) for piece in pieces]) * recording.spacing
