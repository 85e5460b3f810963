"""The states of one effect, simulated along the signals at its port."""

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import (
    LEFT,
    TIME,
    UNTIL,
    Effect,
    EffectState,
    Hold,
    Input,
    Model,
    Output,
    Parameter,
    State,
    System,
    names_in,
    parse,
    symbol,
)
from rigwatch.physics.engine.fit.port_signals import Signals
from rigwatch.physics.engine.fit.recent_runs import RecentRuns, digest
from rigwatch.wire.arrays import FloatArray

_RECENT = RecentRuns()


class EffectStates:
    """The states of one effect, driven by the signals at its port.

    Args:
        effect: with states; its parameters remain parameters of the kernel, compiled once.
        signals: signals the effect may use, by name, each of shape (nodes,); may include time.
        spacing: time from each node to the next, shape (nodes,) [s].
        hold: hold of the signals between nodes, see `equations.hold_at`.
        rows: number of nodes per change of a held signal.
        late: delay of held signals, as a share of the spacing.
    """

    def __init__(  # noqa: PLR0917 -- they belong together
        self,
        effect: Effect,
        signals: Mapping[str, FloatArray],
        spacing: FloatArray,
        hold: Hold,
        rows: int = 1,
        late: float = 0.0,
    ) -> None:
        used = _used(effect)
        # Until when an input stays is told by the inputs, whichever the equations use.
        wanted = signals if LEFT in used else used
        inputs = [name for name in signals if name not in {TIME, LEFT} and name in wanted]
        self._driving = _side_by_side([signals[name] for name in inputs], signals)
        equations = tuple(
            (name, state.derivative, state.update, *_bounds(state))
            for name, state in effect.states.items()
        )
        self._compiled = _alone(equations, tuple(effect.parameters), tuple(inputs), hold, late)
        self._system = self._compiled.system
        self._first = np.array([[state.start for state in effect.states.values()]])
        self._spacing, self._rows = spacing, rows
        self._time = signals.get(TIME) if TIME in used else None
        # Systems with the same equations and names share a kernel.
        made_by = (self._compiled.kernel, rows, hold, late, self._first.tobytes())
        given = (self._driving, spacing, *([] if self._time is None else [self._time]))
        self._key = (*made_by, self._driving.shape, *map(digest, given))

    def run(self, values: Mapping[str, float], arriving: Signals | None = None) -> Signals:
        """Each state by name, shape (nodes,).

        Args:
            values: of the effect's parameters.
            arriving: signals that replace those given at construction.
        """
        parameters = self._compiled.vector(dict(values))
        if arriving:
            found = self._simulated(self._driven_by(arriving), parameters)
        else:
            key = (*self._key, parameters.tobytes())
            found = _RECENT.get(key, lambda: self._simulated(self._driving, parameters))
        return dict(zip(self._system.states, found.T, strict=True))

    def _simulated(self, driving: FloatArray, parameters: FloatArray) -> FloatArray:
        """The states, shape (nodes, states)."""
        run = self._compiled.simulate(
            driving, self._spacing, np.zeros(1, np.int64), len(driving),
            initial=self._first, parameters=parameters, substeps=1, rows=self._rows,
            time=self._time,
        )  # fmt: skip
        return np.asarray(run.outputs[0], np.float64)

    def _driven_by(self, arriving: Signals) -> FloatArray:
        columns = [
            arriving.get(name, own)
            for name, own in zip(self._system.model.inputs, self._driving.T, strict=True)
        ]
        return _side_by_side(columns, arriving)


def _side_by_side(columns: list[FloatArray], signals: Mapping[str, FloatArray]) -> FloatArray:
    """Signals as columns, shape (nodes, columns); without columns as long as the others."""
    length = len(next(iter(signals.values())))
    return np.stack(columns, axis=-1) if columns else np.empty((length, 0))


def _used(effect: Effect) -> set[str]:
    """Names in the equations of an effect's states."""
    texts = [state.derivative or state.update for state in effect.states.values()]
    return {name for text in texts for name in names_in(text, "state")}


def _bounds(state: EffectState) -> tuple[float, float]:
    """What bounds a state without a unit, whose steps depend on it."""
    return (state.low, state.high) if state.unit == "1" else (-math.inf, math.inf)


@lru_cache(maxsize=512)
def _alone(
    equations: tuple[tuple[str, str, str, float, float], ...],
    parameters: tuple[str, ...],
    inputs: tuple[str, ...],
    hold: Hold,
    late: float,
) -> CompiledSystem:
    """The states of one effect as a system of their own.

    Args:
        equations: name, rate of change, value after each sample and `_bounds` of every state.
        parameters: of the effect, by name.
        inputs, hold, late: the signals that drive it.
    """
    states = [name for name, *_ in equations]
    own = (*inputs, TIME, *states, *parameters)
    names = {LEFT: symbol(UNTIL)} | {name: symbol(name) for name in own}
    model = Model(
        name="states of an effect",
        summary="the states of one effect",
        hold=hold,
        inputs={name: Input(unit="1", late=late) for name in inputs},
        parameters={n: Parameter(value=0.0, unit="1", fixed=True) for n in parameters},
        outputs={name: Output(unit="1", expression=name) for name in states},
    )
    own_states = {
        name: State(unit="1", derivative=rate or update, low=low, high=high)
        for name, rate, update, low, high in equations
    }
    rates = {n: parse(rate or "0", names, f"state {n}") for n, rate, *_ in equations}
    updates = {n: parse(update, names, f"state {n}") for n, _, update, *_ in equations if update}
    read = {name: symbol(name) for name in states}
    return compile_system(
        System(model, (), own_states, model.parameters, rates, read, {}, (), updates)
    )
