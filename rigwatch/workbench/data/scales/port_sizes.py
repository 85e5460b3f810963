"""Sizes of the signals at each port, to which initial values and bounds of effects are scaled."""

from functools import cached_property

import numpy as np
from scipy.signal import detrend

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.equations import (
    Model,
    Port,
    arriving,
    compose,
    names_reached,
    spelt_out,
)
from rigwatch.physics.engine.fit import Recording, initial_states, shown_states
from rigwatch.physics.engine.score import sizes_at_port
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data.scales.shown_signals import ShownSignals
from rigwatch.workbench.data.scales.simulated_states import simulated_states

Sizes = dict[str, float]
VARIABLE = "port variable"
MOTION = ("x", "v")
"""Variables of which one unit, the size of what has none, is far from what machines do."""


def port_sizes(model: Model, recording: Recording) -> dict[str, Sizes]:
    """Root mean square of each port's variables on the recording.

    In addition to the port's own variables there are `dt`, the sample period [s], and, at a signal
    port, `u` and `rate`, the rms of the signal and of its rate of change.
    """
    signals = _PortSignals(spelt_out(model), recording)
    return {name: signals.sizes(name) for name in model.ports}


class _PortSignals:
    """Signals at the ports of a model: as measured, computed from that, or simulated.

    Args:
        model: its quantities spelt out.
        recording: for it.
    """

    def __init__(self, model: Model, recording: Recording) -> None:
        self._model, self._recording = model, recording
        self._system = compose(model)
        self._values = {name: p.value for name, p in model.parameters.items()}
        shown = shown_states(self._system)
        self._hidden = {n for index, n in enumerate(self._system.states) if index not in shown}
        self._shown = ShownSignals(self._system, recording)
        self._states = initial_states(self._system, recording)
        self._measured = self._known(self._states)

    def sizes(self, name: str) -> Sizes:
        """Root mean squares at a port."""
        port = self._model.ports[name]
        shown = {n: self._shown_by_channels(v.expression) for n, v in port.variables.items()}
        variables = {
            n: self._inferred(n, port.variables[n].expression) if signal is None else signal
            for n, signal in shown.items()
        }
        if "v" in variables and shown.get("x") is None:
            variables["x"] = _travel(variables["v"], self._recording)
        signal = self._arriving(name, port) if port.signal else None
        return sizes_at_port(variables, signal, self._recording.dt)

    def _known(self, states: FloatArray) -> dict[str, FloatArray]:
        found = dict(zip(self._model.states, states.T, strict=True))
        found |= dict(zip(self._model.inputs, self._recording.inputs.T, strict=True))
        found |= dict(zip(self._model.outputs, self._recording.outputs.T, strict=True))
        for name in self._system.ports:
            found[name] = self._signal(self._model.ports[name], found)
        return found

    def _signal(self, port: Port, signals: dict[str, FloatArray]) -> FloatArray:
        """What arrives at a port, measured or computed from what is; 0 at a force port."""
        if port.kind == "force":
            return np.zeros(len(self._recording))
        if port.signal in signals:
            return signals[port.signal]
        return evaluated(
            arriving(self._model, port), signals, self._values, f"port signal {port.signal}"
        )

    def _arriving(self, name: str, port: Port) -> FloatArray:
        """What arrives at a port; of a run where nobody measures it, as behind a servo's lag."""
        found = self._measured[name]
        measured = port.signal in self._model.inputs or port.signal in self._model.outputs
        return found if measured or np.ptp(found) > 0 else self._simulated[name]

    def _shown_by_channels(self, text: str) -> FloatArray | None:
        """A variable as channels show it, shape (n,); None of one such as the twist of a shaft."""
        if names_reached(self._model, text, VARIABLE) & self._hidden:
            return self._shown.of(text, VARIABLE)
        return evaluated(text, self._measured, self._values, VARIABLE)

    def _inferred(self, name: str, text: str) -> FloatArray:
        """A variable that no channel shows, from initial states or from a run, shape (n,)."""
        found = evaluated(text, self._measured, self._values, VARIABLE)
        # A motion that nobody measures stays at its initial value, which is no size if it is zero.
        if name in MOTION and not np.any(found):
            return evaluated(text, self._simulated, self._values, VARIABLE)
        return found

    @cached_property
    def _simulated(self) -> dict[str, FloatArray]:
        """The signals with the states of a run at the model's starting values."""
        run = simulated_states(self._model, self._recording, self._values, initial=self._states[0])
        return self._known(run)


def _travel(speed: FloatArray, recording: Recording) -> FloatArray:
    """Displacement: the integral of a speed with its drift removed, shape (n,)."""
    ends = np.cumsum(recording.parts or (len(recording),))[:-1]
    pieces = np.split(np.nan_to_num(speed), ends)
    return np.concatenate([detrend(np.cumsum(piece)) for piece in pieces]) * recording.spacing
