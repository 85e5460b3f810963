"""States of effects, simulated along known signals.

The deflection of a contact or the position of a valve within its play is unknown at the first
sample of a window, and the window may not determine it. It is computed from the signals at the
effect's port since the start of the recording: exactly at an actuator, whose input is known;
elsewhere as accurately as the channels measure the signals.
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
    passed_in_turn,
    symbol,
)
from rigwatch.wire.arrays import FloatArray

Signals = dict[str, FloatArray]


class Memory:
    """The states of one effect, driven by the signals at its port.

    Args:
        effect: with states; its parameters remain parameters of the kernel, compiled once.
        signals: signals the effect may use, by name, each of shape (nodes,); may include time.
        spacing: between the nodes [s].
        hold: hold of the signals between nodes, see `held_at`.
        rows: number of nodes per change of a held signal.
        late: delay of held signals, as a share of the spacing.
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

    def run(self, values: Mapping[str, float], arriving: Signals | None = None) -> Signals:
        """Each state by name, shape (nodes,).

        Args:
            values: of the effect's parameters.
            arriving: signals that replace those given at construction.
        """
        parameters = self._compiled.vector(dict(values))
        names = list(self._system.states)
        driving = self._driven_by(arriving) if arriving else self._driving
        run = self._compiled.simulate(
            driving, self._spacing, np.zeros(1, np.int64), len(driving),
            initial=self._first, parameters=parameters, substeps=1, rows=self._rows,
        )  # fmt: skip
        return dict(zip(names, run.outputs[0].T, strict=True))

    def _driven_by(self, arriving: Signals) -> FloatArray:
        columns = [
            arriving.get(name, own)
            for name, own in zip(self._system.model.inputs, self._driving.T, strict=True)
        ]
        return np.stack(columns, axis=-1)


def held_at(model: Model, port: str) -> Hold:
    """Hold of the signals at a port between samples; at an actuator that of its input."""
    place = model.ports[port]
    return model.held(place.signal) if place.kind == "actuator" else "linear"


def late_at(model: Model, port: str) -> float:
    """Delay of held signals at a port, as a share of a sample."""
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
    """The states of one placement and their columns.

    Attributes:
        placement: the effect.
        memory: its states.
        columns: their indices among the system's states.
        signals: at the port, before any effect there.
        before: effects applied to the signal first; their own states are neglected.
    """

    placement: Placement
    memory: Memory
    columns: list[int]
    signals: Signals
    before: list[Placement]

    @property
    def follows_memory(self) -> bool:
        """Whether what arrives depends on what another effect remembers."""
        return any(placement.effect.states for placement in self.before)

    def arriving(self, values: Mapping[str, float], dt: float) -> Signals:
        """The signal as it arrives, with its rate; nothing where no effect stands before."""
        if not self.before:
            return {}
        passed = self.signals["u"]
        for placement in self.before:
            if not placement.effect.states:
                own = _own(placement, values)
                known = self.signals | {"u": passed}
                passed = evaluated(placement.effect.expression, known, own, str(placement))
        return {"u": passed, RATE: np.asarray(np.gradient(passed, dt), np.float64)}


def _own(placement: Placement, values: Mapping[str, float]) -> dict[str, float]:
    """An effect's parameters by its own names."""
    return {name: values[placement.prefix + name] for name in placement.effect.parameters}


def _before(system: System, placement: Placement) -> list[Placement]:
    """Effects that a signal passes before this one; none at a force, where effects add up."""
    if system.model.ports[placement.port].kind == "force":
        return []
    order = passed_in_turn(system.placements, placement.port)
    return order[: order.index(placement)]


class Recall:
    """The states of all effects of a system along a recording.

    Args:
        system: a model with effects.
        inputs: shape (n, inputs).
        states: from the channels, shape (n, states).
        dt: time between samples [s].
        parameters: all parameters, shape (n_p,), on which a port's signals may depend.

    Attributes:
        columns: of the effect states.
        exact: those at actuators, whose input is known.
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
        order, self._dt = list(system.states), dt
        self._kept = []
        for placement in (each for each in system.placements if each.effect.states):
            signals = seen(system, placement, inputs, states, dt, values)
            memory = Memory(
                placement.effect, signals, dt, held_at(system.model, placement.port),
                late=late_at(system.model, placement.port),
            )  # fmt: skip
            columns = [order.index(placement.prefix + name) for name in placement.effect.states]
            before = _before(system, placement)
            self._kept.append(_Kept(placement, memory, columns, signals, before))
        kinds = {name: port.kind for name, port in system.model.ports.items()}
        self.columns = [c for kept in self._kept for c in kept.columns]
        self.exact = [
            c
            for kept in self._kept
            if kinds[kept.placement.port] == "actuator" and not kept.follows_memory
            for c in kept.columns
        ]

    def at(self, parameters: FloatArray) -> dict[int, FloatArray]:
        """Each effect state by its column, shape (n,)."""
        values = dict(zip(self._names, parameters.tolist(), strict=True))
        found: dict[int, FloatArray] = {}
        for kept in self._kept:
            own = _own(kept.placement, values)
            led = kept.memory.run(own, kept.arriving(values, self._dt))
            found |= dict(zip(kept.columns, led.values(), strict=True))
        return found


def seen(  # noqa: PLR0917 -- they belong together
    system: System,
    placement: Placement,
    inputs: FloatArray,
    states: FloatArray,
    dt: float,
    values: Mapping[str, float],
) -> Signals:
    """The signals at an effect's port, computed from the channels.

    Args:
        system: a model with the effect.
        placement: the effect.
        inputs: shape (n, inputs).
        states: from the channels, shape (n, states).
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
