"""A linearised run of a fitted model, and the signals at its ports that drive effects along it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
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
        inputs: at the nodes, those that arrive late last, shape (windows, nodes, inputs).
        time: at the nodes, shape (windows, nodes) [s].
        parameters: all of them, shape (n_p,).
        recordings: windows of each of the joined recordings; all of one if empty.
    """

    compiled: CompiledSystem
    run: Linearisation
    inputs: FloatArray
    time: FloatArray
    parameters: FloatArray
    recordings: tuple[slice, ...] = ()


def trajectory(
    compiled: CompiledSystem,
    inputs: FloatArray,
    dt: float | FloatArray,
    starts: IntArray,
    length: int,
    *,
    initial: FloatArray,
    parameters: FloatArray,
    substeps: int = 4,
    begins: IntArray | None = None,
    time: FloatArray | None = None,
) -> Trajectory:
    """The run of `CompiledSystem.linearise`, same arguments, with inputs and time at its nodes.

    Of a model without states of its own, such as a force along a measured motion, the nodes are
    the samples: the fast states of a contact pass nothing on from one to the next.
    """
    run = compiled.linearise(
        inputs, dt, starts, length, initial=initial, parameters=parameters, substeps=substeps,
        begins=begins, time=time,
    )  # fmt: skip
    if not compiled.system.model.states:
        run, substeps = run.at_samples(), 1
    nodes = np.arange(run.states.shape[1])
    row, place = nodes // substeps, (nodes % substeps) / substeps
    rows = starts[:, None] + row
    spacing = np.broadcast_to(dt, len(inputs))[rows]
    oldest = np.zeros_like(rows) if begins is None else begins[rows]
    model = compiled.system.model
    parameter = dict(zip(compiled.system.parameters, parameters.tolist(), strict=True))
    late: dict[str, tuple[str, FloatArray | float]] = {
        name: (name, own.late) for name, own in model.inputs.items()
    }
    for label, own in compiled.system.delayed.items():
        after = model.inputs[own.name].late + parameter[own.parameter] / spacing
        late[label] = (own.name, after)
    at_nodes = np.empty((*rows.shape, len(late)))
    for column, (name, after) in enumerate(late.values()):
        signal = inputs[:, list(model.inputs).index(name)]
        if model.held(name) == "linear":
            following = np.minimum(rows + 1, len(inputs) - 1)
            at_nodes[..., column] = signal[rows] + place * (signal[following] - signal[rows])
        else:
            behind = np.ceil(after - place).astype(np.int64)
            at_nodes[..., column] = signal[np.maximum(rows - behind, oldest)]
    apart = () if begins is None else _apart(begins[starts])
    return Trajectory(compiled, run, at_nodes, run.time + place * spacing, parameters, apart)


def _apart(begun: IntArray) -> tuple[slice, ...]:
    """Windows of each recording, from the first sample of that of each window."""
    first = np.flatnonzero(np.diff(begun, prepend=-1)).tolist()
    return tuple(slice(*ends) for ends in pairwise([*first, len(begun)]))


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
        signals[RATE] = np.gradient(signals["u"], axis=1) / at.run.spacing
        signals[STEP] = _step(signals["u"], at.run.substeps)
        held = port.kind == "sensor" or hold_at(system.model, port) == "zero"
        signals[LEFT] = held * _left(at)
    return signals


def presence(at: Trajectory) -> FloatArray | float:
    """Where effects are present, at the nodes, shape (windows, nodes); 1 if they are everywhere."""
    place = at.compiled.system.model.presence
    return 1.0 if place is None else at.inputs[..., place]


def _step(signal: FloatArray, substeps: int) -> FloatArray:
    """Change of a signal over the last sample, shape (windows, nodes)."""
    changed = np.zeros_like(signal)
    changed[:, substeps:] = signal[:, substeps:] - signal[:, :-substeps]
    # The signal before a window is unknown: its first change is extrapolated.
    changed[:, :substeps] = changed[:, substeps : 2 * substeps][:, :substeps]
    return changed


def _symbols(system: System) -> dict[str, sympy.Expr]:
    inputs = (*system.model.inputs, *system.delayed)
    names = (*system.states, *system.parameters, *inputs, TIME)
    return {name: symbol(name) for name in names} | dict(system.ports)


def _along(at: Trajectory, expression: sympy.Expr) -> FloatArray:
    """An expression in the system's variables, along the trajectory."""
    system = at.compiled.system
    values: dict[str, Any] = dict(zip(system.parameters, at.parameters.tolist(), strict=True))
    values |= dict.fromkeys(system.probes, 0.0) | {TIME: at.time, UNTIL: _left(at)}
    values |= dict(zip(system.states, np.moveaxis(at.run.states, -1, 0), strict=True))
    inputs = (*system.model.inputs, *system.delayed)
    values |= dict(zip(inputs, np.moveaxis(at.inputs, -1, 0), strict=True))
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

    They are driven by the signals at its port. One run covers all windows of a recording: each
    continues from the end of the previous one, whose last sample is held for one sample period.
    """
    apart = at.recordings or (slice(None),)
    runs = [_recorded(at, candidate, signals, own) for own in apart]

    def found(values: Mapping[str, float]) -> dict[str, FloatArray]:
        each = [run(values) for run in runs]
        return {name: np.concatenate([one[name] for one in each]) for name in each[0]}

    return found


def _recorded(
    at: Trajectory, candidate: Candidate, signals: Mapping[str, FloatArray], own: slice
) -> Callable[[Mapping[str, float]], dict[str, FloatArray]]:
    """`memory` for the windows of one recording."""
    more = ((0, 0), (0, at.run.substeps - 1))
    along = {n: np.pad(signal[own], more, mode="edge").ravel() for n, signal in signals.items()}
    spacing = np.pad(at.run.spacing[own], more, mode="edge").ravel()
    model = at.compiled.system.model
    hold = hold_at(model, model.ports[candidate.port])
    states = EffectStates(candidate.effect, along, spacing, hold, at.run.substeps)
    windows, nodes = at.time[own].shape

    def found(values: Mapping[str, float]) -> dict[str, FloatArray]:
        run = states.run(values).items()
        return {name: state.reshape(windows, -1)[:, :nodes] for name, state in run}

    return found
