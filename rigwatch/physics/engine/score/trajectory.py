"""A linearised run of a fitted model, and the signals at its ports that drive effects along it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from rigwatch.physics.engine.compile import CompiledSystem, Linearisation, numpy_function
from rigwatch.physics.engine.equations import (
    LEFT,
    RATE,
    STEP,
    TIME,
    UNTIL,
    System,
    hold_at,
    parse,
    symbol,
)
from rigwatch.physics.engine.fit import EffectStates
from rigwatch.physics.engine.score.candidates import Candidate
from rigwatch.wire.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A linearised run with the signals at its ports.

    Attributes:
        compiled: the model.
        run: its linearisation.
        inputs: at the nodes, shape (windows, nodes, inputs).
        time: at the nodes, shape (windows, nodes) [s].
        parameters: all of them, shape (n_p,).
    """

    compiled: CompiledSystem
    run: Linearisation
    inputs: FloatArray
    time: FloatArray
    parameters: FloatArray


def trajectory(
    compiled: CompiledSystem,
    inputs: FloatArray,
    dt: float,
    starts: IntArray,
    length: int,
    *,
    initial: FloatArray,
    parameters: FloatArray,
    substeps: int = 4,
) -> Trajectory:
    """The run of `CompiledSystem.linearise` with inputs and time at its nodes."""
    run = compiled.linearise(
        inputs, dt, starts, length, initial=initial, parameters=parameters, substeps=substeps
    )
    nodes = np.arange(run.states.shape[1])
    row, place = nodes // substeps, (nodes % substeps) / substeps
    rows = starts[:, None] + row
    following = np.minimum(rows + 1, len(inputs) - 1)
    model = compiled.system.model
    share = np.outer(place, [model.held(name) == "linear" for name in model.inputs])
    late = np.array([own.late for own in model.inputs.values()])
    before = (place[:, None] < late) & (share == 0.0) & (late > 0)
    kept = np.where(before, inputs[np.maximum(rows - 1, 0)], inputs[rows])
    at_nodes = kept + share * (inputs[following] - inputs[rows])
    return Trajectory(compiled, run, at_nodes, (rows + place) * dt, parameters)


def port_signals(at: Trajectory, port_name: str) -> dict[str, FloatArray]:
    """Signals at an effect's port, at the nodes, each of shape (windows, nodes)."""
    system = at.compiled.system
    port = system.model.ports[port_name]
    signals = {TIME: at.time}
    for name, variable in port.variables.items():
        expression = parse(variable.expression, _symbols(system), f"port {port_name}")
        signals[name] = _along(at, expression)
    if port.kind != "force":
        signals["u"] = _along(at, system.ports[port_name])
        signals[RATE] = np.gradient(signals["u"], at.run.spacing, axis=1)
        signals[STEP] = _step(signals["u"], at.run.substeps)
        held = port.kind == "sensor" or hold_at(system.model, port) == "zero"
        signals[LEFT] = held * _left(at)
    return signals


def _step(signal: FloatArray, substeps: int) -> FloatArray:
    """Change of a signal over the last sample, shape (windows, nodes)."""
    changed = np.zeros_like(signal)
    changed[:, substeps:] = signal[:, substeps:] - signal[:, :-substeps]
    # The signal before a window is unknown: its first change is extrapolated.
    changed[:, :substeps] = changed[:, substeps : 2 * substeps][:, :substeps]
    return changed


def _symbols(system: System) -> dict[str, sympy.Expr]:
    names = (*system.states, *system.parameters, *system.model.inputs, TIME)
    return {name: symbol(name) for name in names} | dict(system.ports)


def _along(at: Trajectory, expression: sympy.Expr) -> FloatArray:
    """An expression in the system's variables, along the trajectory."""
    system = at.compiled.system
    values: dict[str, Any] = dict(zip(system.parameters, at.parameters.tolist(), strict=True))
    values |= dict.fromkeys(system.probes, 0.0) | {TIME: at.time, UNTIL: _left(at)}
    values |= dict(zip(system.states, np.moveaxis(at.run.states, -1, 0), strict=True))
    values |= dict(zip(system.model.inputs, np.moveaxis(at.inputs, -1, 0), strict=True))
    found = numpy_function(list(values), expression)(*values.values())
    return np.broadcast_to(np.asarray(found, np.float64), at.time.shape)


def _left(at: Trajectory) -> FloatArray:
    """Time until held inputs change, at the nodes, shape (windows, nodes) [s]."""
    model = at.compiled.system.model
    kept = any(model.held(name) == "zero" for name in model.inputs)
    substep = np.arange(at.time.shape[1]) % at.run.substeps
    return np.broadcast_to(kept * at.run.spacing * (at.run.substeps - substep), at.time.shape)


def memory(
    at: Trajectory, candidate: Candidate, signals: Mapping[str, FloatArray]
) -> Callable[[Mapping[str, float]], dict[str, FloatArray]]:
    """The effect's own states at the nodes, by name, as a function of its parameters' values.

    They are driven by the signals at its port. One run covers all windows: each window continues
    from the end of the previous one, whose last sample is held for one sample period.
    """
    more = ((0, 0), (0, at.run.substeps - 1))
    along = {name: np.pad(signal, more, mode="edge").ravel() for name, signal in signals.items()}
    model = at.compiled.system.model
    hold = hold_at(model, model.ports[candidate.port])
    states = EffectStates(candidate.effect, along, at.run.spacing, hold, at.run.substeps)
    windows, nodes = at.time.shape

    def found(values: Mapping[str, float]) -> dict[str, FloatArray]:
        run = states.run(values).items()
        return {name: state.reshape(windows, -1)[:, :nodes] for name, state in run}

    return found
