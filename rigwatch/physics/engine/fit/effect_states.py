"""The memory of effects, run along signals that are known: what it holds at any instant.

A contact that is bent or a valve in its play holds something at the first sample of a window that
no channel shows and that the window itself may never tell. The signals at the effect's port lead
there from the start of the recording: at an actuator exactly, since inputs are known; elsewhere as
well as the channels show them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, compile_system, evaluated
from rigwatch.physics.engine.equations import (
    LEFT,
    RATE,
    TIME,
    UNTIL,
    Effect,
    Hold,
    Input,
    Model,
    Output,
    Parameter,
    Placement,
    State,
    System,
    parse,
    symbol,
)
from rigwatch.wire.arrays import FloatArray

Signals = dict[str, FloatArray]


class Memory:
    """The states of one effect, driven by what is at its port.

    Args:
        effect: with states; its parameters stay parameters of the kernel, which is compiled once.
        signals: what the effect may name, by name, each of shape (nodes,); time may be among them.
        spacing: between the nodes [s].
        hold: what signals do between the nodes, see `held_at`.
        rows: nodes after which signals that are kept change.
        late: share of the spacing by which they change late.
    """

    def __init__(  # noqa: PLR0917 -- they belong together
        self,
        effect: Effect,
        signals: Mapping[str, FloatArray],
        spacing: float,
        hold: Hold,
        rows: int = 1,
        late: float = 0.0,
    ) -> None:
        inputs = [name for name in signals if name not in {TIME, LEFT}]
        self._driving = np.stack([signals[name] for name in inputs], axis=-1)
        self._system = _alone(effect, inputs, hold, late)
        self._compiled: CompiledSystem = compile_system(self._system)
        self._first = np.array([[state.start for state in effect.states.values()]])
        self._spacing, self._rows = spacing, rows

    def run(self, values: Mapping[str, float]) -> Signals:
        """Each state by name, shape (nodes,), for these values of the effect's parameters."""
        parameters = self._compiled.vector(dict(values))
        names = list(self._system.states)
        run = self._compiled.simulate(
            self._driving, self._spacing, np.zeros(1, np.int64), len(self._driving),
            initial=self._first, parameters=parameters, substeps=1, rows=self._rows,
        )  # fmt: skip
        return dict(zip(names, run.outputs[0].T, strict=True))


def held_at(model: Model, port: str) -> Hold:
    """How signals at a port go on between samples: that of an actuator as the input that it is."""
    place = model.ports[port]
    return model.held(place.signal) if place.kind == "actuator" else "linear"


def late_at(model: Model, port: str) -> float:
    """Share of a sample by which signals at a port are late, where they are kept."""
    place = model.ports[port]
    return model.inputs[place.signal].late if place.kind == "actuator" else 0.0


def _alone(effect: Effect, inputs: list[str], hold: Hold, late: float) -> System:
    """The states of one effect as a system of their own."""
    own = (*inputs, TIME, *effect.states, *effect.parameters)
    names = {LEFT: symbol(UNTIL)} | {name: symbol(name) for name in own}
    model = Model(
        name="memory of an effect",
        summary="the states of one effect",
        hold=hold,
        inputs={name: Input(unit="1", late=late) for name in inputs},
        parameters={n: Parameter(value=0.0, unit="1", fixed=True) for n in effect.parameters},
        outputs={name: Output(unit="1", expression=name) for name in effect.states},
    )
    states = {
        n: State(unit="1", derivative=s.derivative or s.update) for n, s in effect.states.items()
    }
    rates = {n: parse(s.derivative or "0", names, f"state {n}") for n, s in effect.states.items()}
    updates = {
        n: parse(s.update, names, f"state {n}") for n, s in effect.states.items() if s.update
    }
    read = {name: symbol(name) for name in effect.states}
    return System(model, (), states, model.parameters, rates, read, {}, (), updates)


@dataclass(frozen=True, eq=False)
class _Kept:
    """One placement's memory and the columns of its states."""

    placement: Placement
    memory: Memory
    columns: list[int]


class Recall:
    """The memories of all effects of a system along a recording.

    Args:
        system: a model with effects.
        inputs: shape (n, inputs).
        states: as the channels show them, shape (n, states).
        dt: time between samples [s].
        parameters: all of them, for what a port's signals depend on, shape (n_p,).

    Attributes:
        columns: of the states that effects keep.
        exact: those of them at actuators, whose input is known.
    """

    def __init__(
        self,
        system: System,
        inputs: FloatArray,
        states: FloatArray,
        dt: float,
        parameters: FloatArray,
    ) -> None:
        self._names = list(system.parameters)
        values = dict(zip(self._names, parameters.tolist(), strict=True))
        order = list(system.states)
        self._kept = [
            _Kept(
                placement,
                Memory(
                    placement.effect,
                    seen(system, placement, inputs, states, dt, values),
                    dt,
                    held_at(system.model, placement.port),
                    late=late_at(system.model, placement.port),
                ),
                [order.index(placement.prefix + name) for name in placement.effect.states],
            )
            for placement in system.placements
            if placement.effect.states
        ]
        kinds = {name: port.kind for name, port in system.model.ports.items()}
        self.columns = [c for kept in self._kept for c in kept.columns]
        self.exact = [
            c
            for kept in self._kept
            if kinds[kept.placement.port] == "actuator"
            for c in kept.columns
        ]

    def at(self, parameters: FloatArray) -> dict[int, FloatArray]:
        """Each memory by its column, shape (n,)."""
        values = dict(zip(self._names, parameters.tolist(), strict=True))
        found: dict[int, FloatArray] = {}
        for kept in self._kept:
            prefix = kept.placement.prefix
            own = {name: values[prefix + name] for name in kept.placement.effect.parameters}
            found |= dict(zip(kept.columns, kept.memory.run(own).values(), strict=True))
        return found


def seen(  # noqa: PLR0917 -- they belong together
    system: System,
    placement: Placement,
    inputs: FloatArray,
    states: FloatArray,
    dt: float,
    values: Mapping[str, float],
) -> Signals:
    """The signals that an effect may name at its port, as the channels show them.

    Args:
        system: a model with the effect.
        placement: the effect.
        inputs: shape (n, inputs).
        states: as the channels show them, shape (n, states).
        dt: time between samples [s].
        values: parameters by name.
    """
    port = system.model.ports[placement.port]
    known: Signals = {TIME: dt * np.arange(len(inputs), dtype=np.float64)}
    known |= dict(zip(system.states, states.T, strict=True))
    known |= dict(zip(system.model.inputs, inputs.T, strict=True))
    for name, other in system.model.ports.items():
        if other.kind != "sensor":
            known[name] = known.get(other.signal, np.zeros(len(inputs)))

    def along(text: str) -> FloatArray:
        return evaluated(text, known, values, f"port {placement.port}")

    seen = {name: along(variable.expression) for name, variable in port.variables.items()}
    if port.kind != "force":
        sensor = port.kind == "sensor"
        text = system.model.outputs[port.signal].expression if sensor else port.signal
        seen["u"] = along(text)
        seen[RATE] = np.asarray(np.gradient(seen["u"], dt), np.float64)
    return {TIME: known[TIME], **seen}
