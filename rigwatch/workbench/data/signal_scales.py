"""How large the signals at each port are: starts and bounds of effects are shares of that."""

import numpy as np
from scipy.signal import detrend

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.equations import Model, Port, compose
from rigwatch.physics.engine.fit import Recording, initial_states
from rigwatch.wire.arrays import FloatArray

Sizes = dict[str, float]


def port_sizes(model: Model, recording: Recording) -> dict[str, Sizes]:
    """Root mean squares of what effects at each port see, as the recording shows it.

    Beside the port's own variables there are `dt`, the time between samples [s], and at a signal
    `u` and `rate`, the size of its rate of change.
    """
    signals = _measured(model, recording)
    return {name: _sizes(port, model, signals, recording) for name, port in model.ports.items()}


def _measured(model: Model, recording: Recording) -> dict[str, FloatArray]:
    states = initial_states(compose(model), recording)
    found = dict(zip(model.states, states.T, strict=True))
    found |= dict(zip(model.inputs, recording.inputs.T, strict=True))
    found |= dict(zip(model.outputs, recording.outputs.T, strict=True))
    for name, port in model.ports.items():
        found[name] = found[port.signal] if port.signal else np.zeros(len(recording))
    return found


def _travel(speed: FloatArray, recording: Recording) -> FloatArray:
    """Distance that a speed goes to and fro in, its drift left out; shape (n,)."""
    ends = np.cumsum(recording.parts or (len(recording),))[:-1]
    there = np.nan_to_num(speed)
    pieces = np.split(there, ends)
    return np.concatenate([detrend(np.cumsum(piece)) * recording.dt for piece in pieces])


def _sizes(port: Port, model: Model, signals: dict[str, FloatArray], recording: Recording) -> Sizes:
    values = {name: p.value for name, p in model.parameters.items()}
    sizes = {"dt": recording.dt}
    for name, variable in port.variables.items():
        sizes[name] = _rms(evaluated(variable.expression, signals, values, f"port variable {name}"))
    if "v" in port.variables and "x" not in port.variables:
        speed = evaluated(port.variables["v"].expression, signals, values, "port variable v")
        sizes["x"] = _rms(_travel(speed, recording))
    if port.signal:
        sizes["u"] = _rms(signals[port.signal])
        sizes["rate"] = _rms(np.gradient(signals[port.signal], recording.dt))
    return sizes


def _rms(signal: FloatArray) -> float:
    size = float(np.sqrt(np.nanmean(np.square(signal))))
    return size if size > 0 else 1.0
