"""States of all effects of a model along a recording.

The deflection of a contact or the position of a valve within its play is unknown at the first
sample of a window, and the window may not determine it. It is computed from the signals at the
effect's port since the start of the recording: exactly at the actuator of an input, which
is known; elsewhere as accurately as the channels measure the signals. A state that counts from the
beginning of each recording, such as the path since then, is known there, and is not fitted.
"""

from collections.abc import Mapping, Sequence
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
        states: its states, of each recording apart.
        columns: their indices among the system's states.
        signals: at the port, before any effect there.
        before: effects applied to the signal first; their own states are neglected.
        parts: samples that each of `states` runs through.
    """

    placement: Placement
    states: list[EffectStates]
    columns: list[int]
    signals: Signals
    before: list[Placement]
    parts: Sequence[slice]

    @property
    def after_effect_with_states(self) -> bool:
        """Whether the arriving signal depends on the states of another effect."""
        return any(placement.effect.states for placement in self.before)

    @property
    def counted(self) -> list[int]:
        """Columns of the states that are known at the beginning of each recording."""
        states = self.placement.effect.states.values()
        return [c for c, state in zip(self.columns, states, strict=True) if state.known]

    def run(
        self, own: Mapping[str, float], values: Mapping[str, float], spacing: FloatArray
    ) -> list[FloatArray]:
        """Each state along all samples, shape (n,).

        Args:
            own: the effect's parameters by its own names.
            values: all parameters by name.
            spacing: time from each sample to the next, shape (n,) [s].
        """
        arriving = self.arriving(values, spacing)
        runs = [
            states.run(own, {name: signal[part] for name, signal in arriving.items()})
            for states, part in zip(self.states, self.parts, strict=True)
        ]
        return [np.concatenate([run[name] for run in runs]) for name in runs[0]]

    def arriving(self, values: Mapping[str, float], spacing: FloatArray) -> Signals:
        """The arriving signal and its rate; empty if the effect is the first at its port."""
        if not self.before:
            return {}
        passed = self.signals["u"]
        for placement in self.before:
            if not placement.effect.states:
                own = _own(placement, values)
                known = self.signals | {"u": passed}
                passed = evaluated(placement.effect.expression, known, own, str(placement))
        return {"u": passed, RATE: np.asarray(np.gradient(passed) / spacing, np.float64)}


def _own(placement: Placement, values: Mapping[str, float]) -> dict[str, float]:
    """An effect's parameters by its own names."""
    return {name: values[placement.prefix + name] for name in placement.effect.parameters}


def _before(system: System, placement: Placement) -> list[Placement]:
    """Effects that a signal passes before this one; none at a force port, where effects add."""
    if system.model.ports[placement.entry].kind == "force":
        return []
    order = signal_order(system.placements, placement.entry)
    return order[: order.index(placement)]


class RecordedEffectStates:
    """The states of all effects of a system along a recording.

    Args:
        system: a model with effects.
        inputs: shape (n, inputs).
        states: from the channels, shape (n, states).
        time: of each sample, shape (n,) [s].
        spacing: time from each sample to the next, shape (n,) [s].
        parameters: all parameters, shape (n_p,), on which a port's signals may depend.
        parts: samples of each of the joined recordings; all of one if None.

    Attributes:
        columns: of the effect states.
        counted: those known at the beginning of each recording.
        exact: these, and those at the actuators of inputs, which are known.
    """

    def __init__(  # noqa: PLR0917 -- they belong together
        self,
        system: System,
        inputs: FloatArray,
        states: FloatArray,
        time: FloatArray,
        spacing: FloatArray,
        parameters: FloatArray,
        parts: Sequence[slice] | None = None,
    ) -> None:
        self._names = list(system.parameters)
        values = dict(zip(self._names, parameters.tolist(), strict=True))
        order, self._spacing = list(system.states), spacing
        self._placed = []
        for placement in (each for each in system.placements if each.effect.states):
            signals = port_signals(system, placement, inputs, states, time, spacing, values)
            port = system.model.ports[placement.entry]
            apart = parts or [slice(None)]
            own = [
                EffectStates(
                    placement.effect, {n: s[part] for n, s in signals.items()}, spacing[part],
                    hold_at(system.model, port), late=delay_at(system.model, port),
                )
                for part in apart
            ]  # fmt: skip
            columns = [order.index(placement.prefix + name) for name in placement.effect.states]
            before = _before(system, placement)
            self._placed.append(_PlacedStates(placement, own, columns, signals, before, apart))
        known = {n for n, port in system.model.ports.items() if port.signal in system.model.inputs}
        self.columns = [c for placed in self._placed for c in placed.columns]
        self.counted = [c for placed in self._placed for c in placed.counted]
        driven = [
            c
            for placed in self._placed
            if placed.placement.entry in known and not placed.after_effect_with_states
            for c in placed.columns
        ]
        self.exact = sorted({*driven, *self.counted})

    def at(self, parameters: FloatArray) -> dict[int, FloatArray]:
        """Each effect state by its column, shape (n,)."""
        values = dict(zip(self._names, parameters.tolist(), strict=True))
        found: dict[int, FloatArray] = {}
        for placed in self._placed:
            own = _own(placed.placement, values)
            found |= dict(zip(placed.columns, placed.run(own, values, self._spacing), strict=True))
        return found
