"""Equations driven along the measured motion, block by block, with carried hidden states.

Two further predictions run with unit dry and unit viscous friction at the force port. Their
differences to the plain prediction are the responses of the predicted output to friction of 1 N and
of 1 N s/m, including everything in between (an inertia, the sensor's own high-pass). As the motion
is given, the response is linear in the force. A fourth runs with inputs weaker by `WEAKER`, as of
a drive that lost gain. A fifth runs with inputs late by `LATER`, which gives the response to inputs
late by one sample, a sixth with inputs that are held and late by `LATER`: they lack steps before
each sample only. A seventh runs with the inputs' edges between samples, where they are known to be
regular.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from monitor.model import EquationsPlant
from monitor.observer.lagged_motion import EMPTY, FIRST
from monitor.observer.missing_force import LATER, WEAKER
from monitor.signals import LARGEST, Codes
from rigwatch.physics.engine.compile import CompiledSystem, Simulation, compile_system
from rigwatch.physics.engine.equations import (
    Effect,
    Model,
    Output,
    Placement,
    System,
    along_measured_motion,
    compose,
    library,
    load_model,
    measured_states,
    predicted_outputs,
    shipped_models,
    spelt_out,
)
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.errors import ModelError

SETTLING = 8.0
"""Time for which the first sample is held, so that hidden states start in equilibrium [s]."""
SUBSTEPS = 4
"""Runge-Kutta steps between samples."""
PAUSE = 32
"""Samples after a divergence before the states begin anew: what caused it, such as readings that no
motion has, is then gone from the kernels, and a lasting cause costs no time.
"""
DRY, VISCOUS = "coulomb", "viscous"
"""Effects of the library that represent friction."""


def base_model(name: str) -> Model:
    """The model of equations named by a plant.

    Raises:
        ModelError: there is none of this name.
    """
    if name.endswith(".toml"):
        return load_model(Path(name))
    known = shipped_models()
    if name not in known:
        raise ModelError(f"found model {name!r}, expected one of {', '.join(known)}, or a file")
    return known[name]


def force_port(model: Model) -> str:
    """The port at which friction enters.

    Raises:
        ModelError: no force port has a speed.
    """
    for name, port in model.ports.items():
        if port.kind == "force" and not port.passive and "v" in port.variables:
            return name
    raise ModelError(f"{model.name}: found no force port with a speed v, expected one for friction")


def speed_state(model: Model, port: str) -> str:
    """The measured state that is the speed at a port."""
    return spelt_out(model).ports[port].variables["v"].expression


def rate_columns(model: Model) -> list[int]:
    """Indices, among inputs and motion, of the states that are rates of change."""
    first = len(model.inputs)
    return [first + k for k, state in enumerate(measured_states(model)) if state.order]


def driven(model: Model, free: frozenset[str]) -> Model:
    """The model along its measured motion, with its hidden states as further outputs.

    Args:
        model: the unmodified model.
        free: parameters to be fitted.
    """
    along = along_measured_motion(model)
    outputs = {name: along.outputs[name] for name in list(along.outputs)[:1]}
    outputs |= {
        f"state_{name}": Output(unit=state.unit, expression=name)
        for name, state in along.states.items()
    }
    kept = {n: p for n, p in along.ports.items() if p.kind != "sensor" or p.signal in outputs}
    parameters = {n: replace(p, fixed=n not in free) for n, p in along.parameters.items()}
    return replace(along, outputs=outputs, ports=kept, parameters=parameters)


def friction_at(port: str, turn: float) -> list[Placement]:
    """Dry and viscous friction at the port, both of zero strength."""
    sizes = {"v": turn * 1e3, "x": 1.0}
    known = library()
    return [Placement(name, _fixed(known[name].scaled(sizes)), port) for name in (DRY, VISCOUS)]


def _fixed(effect: Effect) -> Effect:
    """The effect with all parameters constant except its strength, which starts at zero."""
    parameters = {
        name: p if p.role == "strength" else replace(p, role="constant")
        for name, p in effect.parameters.items()
    }
    return replace(effect, parameters=parameters)


@dataclass(frozen=True, eq=False)
class Predicted:
    """Columns of the prediction, each of shape (n,) or (n, hidden states).

    `weak` and `weak_hidden` are output and hidden states with inputs weaker by `WEAKER`, `late` and
    `late_hidden` those with inputs late by `LATER`, `held_late` and `held_late_hidden` those with
    inputs that are held as well, `moved` and `moved_hidden` those with edges between samples;
    `reset` marks samples at which the states diverged.
    """

    output: FloatArray
    dry: FloatArray
    viscous: FloatArray
    weak: FloatArray
    late: FloatArray
    held_late: FloatArray
    hidden: FloatArray
    weak_hidden: FloatArray
    late_hidden: FloatArray
    held_late_hidden: FloatArray
    moved: FloatArray
    moved_hidden: FloatArray
    reset: BoolArray


class AlongMotion:
    """The running prediction of one plant.

    Raises:
        ModelError: the plant names parameters that its model does not have.
    """

    def __init__(self, plant: EquationsPlant, rate: float) -> None:
        base = base_model(plant.model)
        model = driven(base, frozenset())
        self._rates = rate_columns(base)
        frictions = friction_at(plant.port, plant.turn)
        system = compose(model, frictions)
        self._compiled, self._dt = compile_system(_without_fit(system)), 1.0 / rate
        self.hidden = len(system.states)
        strengths = [f"{p.prefix}{p.effect.strength}" for p in frictions]
        values = dict(zip(plant.names, plant.values, strict=True))
        healthy = values | {strengths[0]: plant.coulomb, strengths[1]: 0.0}
        cases = [healthy, *(healthy | {name: healthy[name] + 1.0} for name in strengths)]
        self._parameters = [self._compiled.vector(case) for case in (*cases, *[healthy] * 4)]
        self._states = [np.zeros(0)] * len(self._parameters)
        self._usual: FloatArray | None = None
        self._slow = plant.turn
        self._last = np.zeros((5, 0))
        self._pause = -1

    def follow(self, usual: FloatArray | None) -> None:
        """Use these means of the hidden states of a healthy rig, shape (hidden,), if known."""
        self._usual = usual

    def update(
        self,
        rows: FloatArray,
        steps: FloatArray,
        moved: FloatArray,
        state: Codes,
        moves: BoolArray,
    ) -> Predicted:
        """Predict the next rows of inputs and motion, shape (n, inputs); 0 without a kernel.

        Args:
            rows: inputs, then motion.
            steps: changes of the inputs per sample, around each and before it, shape
                (2, n, inputs other than motion).
            moved: what their means gain by edges between samples, of the shape of either.
            state: of each row; changed where the states diverge: the rows of a pause count as
                without a kernel, and the one after it as the first.
            moves: whether that is known, shape (n,).
        """
        n = len(rows)
        self._wait(state)
        weaker, later, held = rows.copy(), rows.copy(), rows.copy()
        inputs = moved.shape[1]
        weaker[:, :inputs] *= 1.0 - WEAKER
        later[:, :inputs] -= LATER * steps[0]
        held[:, :inputs] -= LATER * steps[1]
        between = rows.copy()
        between[:, :inputs] += moved
        output, dry, viscous, weak, late, held_late, edged = np.zeros((7, n))
        hidden, weak_hidden, late_hidden, held_hidden, edged_hidden = np.zeros((5, n, self.hidden))
        reset = np.zeros(n, np.bool_)
        out = Predicted(
            output, dry, viscous, weak, late, held_late, hidden, weak_hidden, late_hidden,
            held_hidden, edged, edged_hidden, reset,
        )  # fmt: skip
        begin = 0
        while begin < n:
            if state[begin] == EMPTY:
                begin += 1
                continue
            if state[begin] == FIRST:
                self._begin(rows[begin], steps[0, begin])
            end = _end(state, moves, begin)
            given = [each[begin:end] for each in (rows, weaker, later, held, between)]
            begin += self._run(given, bool(moves[begin]), begin, out)
            if reset[begin - 1]:
                self._pause = PAUSE
                self._wait(state[begin - 1 :])
        return out

    def _wait(self, state: Codes) -> None:
        """Mark the rows of a pause, and the first after it."""
        for k in range(state.size):
            if self._pause < 0:
                return
            if self._pause > 0:
                state[k] = EMPTY
                self._pause -= 1
            elif state[k] != EMPTY:
                state[k], self._pause = FIRST, -1

    def _begin(self, row: FloatArray, steps: FloatArray) -> None:
        """Hidden states at a row: in equilibrium with it at rest, else the means of a healthy rig.

        An instant of a drive is no equilibrium: at its crest the mean of an AC-coupled sensor would
        begin with the acceleration that a lasting crest causes, and forget it only with the
        sensor's corner.
        """
        self._last = np.stack([row] * 5)
        moves = np.abs(row[self._rates]).max(initial=0.0) > self._slow or np.any(steps)
        if self._usual is not None and moves:
            self._states = [self._usual] * len(self._parameters)
            return
        still = np.repeat(row[None, :], round(SETTLING / self._dt), axis=0)
        still[:, self._rates] = 0.0
        for case, parameters in enumerate(self._parameters):
            self._states[case] = balanced(self._compiled, parameters, still, self._dt)

    def _run(self, rows: list[FloatArray], moves: bool, first: int, out: Predicted) -> int:
        """Run along the rows until they end or diverge; returns the number done.

        Args:
            rows: as they are, weaker, late, held and late, and with edges between samples.
            moves: whether the last differ from the first.
            first: index of the first row.
            out: to be filled.
        """
        plain, weaker, shifted, held, between = (
            np.concatenate([last[None, :], own]) for last, own in zip(self._last, rows, strict=True)
        )
        given = [plain] * (len(self._parameters) - 4) + [weaker, shifted, held]
        made = [self._simulated(case, own) for case, own in enumerate(given)]
        made.append(self._simulated(len(given), between) if moves else made[0])
        outputs = np.stack([one.outputs[0, 1:] for one in made])
        # Also false for NaN; the hidden states are among the outputs.
        within = (np.abs(outputs) <= LARGEST).all(axis=(0, 2))
        if good := bool(within.all()):
            self._states = [one.last[0] for one in made]
            self._last = np.stack([own[-1] for own in rows])
        kept = len(plain) - 1 if good else int(np.argmin(within))
        at, outputs = slice(first, first + kept), outputs[:, :kept]
        out.output[at], out.hidden[at] = outputs[0, :, 0], outputs[0, :, 1:]
        out.dry[at] = outputs[1, :, 0] - outputs[0, :, 0]
        out.viscous[at] = outputs[2, :, 0] - outputs[0, :, 0]
        out.weak[at], out.weak_hidden[at] = outputs[3, :, 0], outputs[3, :, 1:]
        out.late[at], out.late_hidden[at] = outputs[4, :, 0], outputs[4, :, 1:]
        out.held_late[at], out.held_late_hidden[at] = outputs[5, :, 0], outputs[5, :, 1:]
        out.moved[at], out.moved_hidden[at] = outputs[6, :, 0], outputs[6, :, 1:]
        if good:
            return kept
        out.reset[first + kept] = True
        return kept + 1

    def _simulated(self, case: int, inputs: FloatArray) -> Simulation:
        with np.errstate(over="ignore", invalid="ignore"):
            return self._compiled.simulate(
                inputs, self._dt, np.zeros(1, np.int64), len(inputs),
                initial=self._states[case][None, :], parameters=self._parameters[case],
                substeps=SUBSTEPS,
            )  # fmt: skip


def _end(state: Codes, moves: BoolArray, begin: int) -> int:
    """Where a run of samples with a complete kernel ends; a change begins a new one."""
    for k in range(begin + 1, state.size):
        if moves[k] != moves[begin] or state[k] in (EMPTY, FIRST):
            return k
    return int(state.size)


def _without_fit(system: System) -> System:
    """The system without free parameters, so that no sensitivities are computed."""
    fixed = {name: replace(p, fixed=True) for name, p in system.parameters.items()}
    return dataclasses.replace(system, parameters=fixed)


def balanced(
    compiled: CompiledSystem, parameters: FloatArray, still: FloatArray, dt: float
) -> FloatArray:
    """Hidden states after rows at rest, shape (states,); the model's own if they diverge."""
    start = np.array([state.start for state in compiled.system.states.values()])
    with np.errstate(over="ignore", invalid="ignore"):
        made = compiled.simulate(
            still, dt, np.zeros(1, np.int64), len(still),
            initial=start[None, :], parameters=parameters, substeps=SUBSTEPS,
        )  # fmt: skip
    return made.last[0] if np.isfinite(made.last).all() else start


def predicted_channel(model: Model) -> str:
    """The channel that the prediction is compared with.

    Raises:
        ModelError: no measured output is left to predict.
    """
    names = predicted_outputs(model)
    if not names:
        raise ModelError(f"{model.name}: found no output to predict along the measured motion")
    return model.outputs[names[0]].channel or names[0]
