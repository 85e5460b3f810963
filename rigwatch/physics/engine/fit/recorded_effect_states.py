"""States of all effects of a model along a recording.

The deflection of a contact or the position of a valve within its play is unknown at the first
sample of a window, and the window may not determine it. It is computed from the signals at the
effect's port since the start of the recording: exactly at the actuator of an input, which
is known; elsewhere as accurately as the channels measure the signals.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.equations import (
    RATE,
    Placement,
    System,
    delay_at,
    hold_at,
    signal_order,
)
from rigwatch.physics.engine.fit.effect_states import EffectStates
from rigwatch.physics.engine.fit.port_signals import Signals, port_signals
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class _PlacedStates:
    """The states of one effect at its port, and their columns.

    Attributes:
        placement: the effect.
        states: its states.
        columns: their indices among the system's states.
        signals: at the port, before any effect there.
        before: effects applied to the signal first; their own states are neglected.
    """

    placement: Placement
    states: EffectStates
    columns: list[int]
    signals: Signals
    before: list[Placement]

    @property
    def after_effect_with_states(self) -> bool:
        """Whether the arriving signal depends on the states of another effect."""
        return any(placement.effect.states for placement in self.before)

    def arriving(self, values: Mapping[str, float], dt: float) -> Signals:
        """The arriving signal and its rate; empty if the effect is the first at its port."""
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
    """Effects that a signal passes before this one; none at a force port, where effects add."""
    if system.model.ports[placement.port].kind == "force":
        return []
    order = signal_order(system.placements, placement.port)
    return order[: order.index(placement)]


class RecordedEffectStates:
    """The states of all effects of a system along a recording.

    Args:
        system: a model with effects.
        inputs: shape (n, inputs).
        states: from the channels, shape (n, states).
        dt: time between samples [s].
        parameters: all parameters, shape (n_p,), on which a port's signals may depend.

    Attributes:
        columns: of the effect states.
        exact: those at the actuators of inputs, which are known.
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
        self._placed = []
        for placement in (each for each in system.placements if each.effect.states):
            signals = port_signals(system, placement, inputs, states, dt, values)
            port = system.model.ports[placement.port]
            own = EffectStates(
                placement.effect, signals, dt, hold_at(system.model, port),
                late=delay_at(system.model, port),
            )  # fmt: skip
            columns = [order.index(placement.prefix + name) for name in placement.effect.states]
            before = _before(system, placement)
            self._placed.append(_PlacedStates(placement, own, columns, signals, before))
        known = {n for n, port in system.model.ports.items() if port.signal in system.model.inputs}
        self.columns = [c for placed in self._placed for c in placed.columns]
        self.exact = [
            c
            for placed in self._placed
            if placed.placement.port in known and not placed.after_effect_with_states
            for c in placed.columns
        ]

    def at(self, parameters: FloatArray) -> dict[int, FloatArray]:
        """Each effect state by its column, shape (n,)."""
        values = dict(zip(self._names, parameters.tolist(), strict=True))
        found: dict[int, FloatArray] = {}
        for placed in self._placed:
            own = _own(placed.placement, values)
            states = placed.states.run(own, placed.arriving(values, self._dt))
            found |= dict(zip(placed.columns, states.values(), strict=True))
        return found
