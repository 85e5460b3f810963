"""Equations driven along the measured motion, block by block, with carried hidden states.

Beside the plain one run (`Run`) two with unit dry and unit viscous friction at the force port.
Their differences to it are the responses of the predicted output to friction of 1 N and of 1 N s/m,
including everything in between (an inertia, the sensor's own high-pass). As the motion is given,
the response is linear in the force. One runs with inputs weaker by `WEAKER`, as of a drive that
lost gain. One runs with inputs late by `LATER`, which gives the response to inputs late by one
sample, one with inputs that are held and late by `LATER`: they lack steps before each sample only.
The last runs with the inputs' edges between samples, where they are known to be regular.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
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
    with_variants,
)
from rigwatch.wire.arrays import BoolArray, FloatArray, IntArray
from rigwatch.wire.errors import ModelError

SETTLING = 8.0
"""Time for which the first sample is held, so that hidden states start in equilibrium [s].

After as long a rest they stay as they are, so that a start after a night is one as after minutes:
the model may not know what holds the rig at rest.
"""
SUBSTEPS = 4
"""Runge-Kutta steps between samples."""
PAUSE = 32
"""Samples after a divergence before the states begin anew: what caused it, such as readings that no
motion has, is then gone from the kernels, and a lasting cause costs no time.
"""
DRY, VISCOUS = "coulomb", "viscous"
"""Effects of the library that represent friction."""


def base_model(name: str) -> Model:
    """The model of equations of this name.

    Raises:
        ModelError: there is none of this name.
    """
    if name.endswith(".toml"):
        return load_model(Path(name))
    known = shipped_models()
    if name not in known:
        raise ModelError(f"found model {name!r}, expected one of {', '.join(known)}, or a file")
    return known[name]


def equations_of(plant: EquationsPlant) -> Model:
    """The model of equations of a plant, with its variants.

    Raises:
        ModelError: there is no such model, or it has no such variants.
    """
    return with_variants(base_model(plant.model), plant.variants)


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


class Run(IntEnum):
    """The runs of a prediction, in order."""

    PLAIN = 0
    DRY = 1
    VISCOUS = 2
    WEAK = 3
    LATE = 4
    HELD_LATE = 5
    MOVED = 6


UNIT_FRICTION = (Run.DRY, Run.VISCOUS)
WITH_OTHER_INPUTS = (Run.WEAK, Run.LATE, Run.HELD_LATE, Run.MOVED)


@dataclass(frozen=True, eq=False)
class Predicted:
    """What the runs predict.

    Attributes:
        outputs: the predicted output, shape (n, runs).
        states: hidden states, shape (n, runs, hidden).
        reset: whether the states diverged at a sample, shape (n,).
    """

    outputs: FloatArray
    states: FloatArray
    reset: BoolArray

    @property
    def output(self) -> FloatArray:
        """The predicted output of the plain run, shape (n,)."""
        return self.outputs[:, Run.PLAIN]

    @property
    def hidden(self) -> FloatArray:
        """Hidden states of the plain run, shape (n, hidden)."""
        return self.states[:, Run.PLAIN]

    def change(self, run: Run) -> FloatArray:
        """What the output of a run has beyond that of the plain one, shape (n,)."""
        return self.outputs[:, run] - self.output

    def part(self, at: slice) -> "Predicted":
        """Some samples."""
        return Predicted(self.outputs[at], self.states[at], self.reset[at])


Rows = Mapping[Run, FloatArray]
"""Inputs and motion of each run, shape (n, inputs)."""


class AlongMotion:
    """The running prediction of one plant.

    Raises:
        ModelError: the plant names parameters that its model does not have.
    """

    def __init__(self, plant: EquationsPlant, rate: float) -> None:
        base = equations_of(plant)
        model = driven(base, frozenset())
        self._rates = rate_columns(base)
        frictions = friction_at(plant.port, plant.turn)
        system = compose(model, frictions)
        self._compiled, self._dt = compile_system(_without_fit(system)), 1.0 / rate
        self.hidden = len(system.states)
        strengths = [f"{p.prefix}{p.effect.strength}" for p in frictions]
        values = dict(zip(plant.names, plant.values, strict=True))
        healthy = values | {strengths[0]: plant.coulomb, strengths[1]: 0.0}
        unit = {
            run: {name: healthy[name] + 1.0}
            for run, name in zip(UNIT_FRICTION, strengths, strict=True)
        }
        self._parameters = [self._compiled.vector(healthy | unit.get(run, {})) for run in Run]
        self._states = [np.zeros(0)] * len(Run)
        self._usual: FloatArray | None = None
        self._slow = plant.turn
        self._last = dict.fromkeys(Run, np.zeros(0))
        self._pause = -1
        self._rested, self._settled = 0, round(SETTLING * rate)

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
        given = _given(rows, steps, moved)
        out = Predicted(
            np.zeros((n, len(Run))), np.zeros((n, len(Run), self.hidden)), np.zeros(n, np.bool_)
        )
        begin, rests = 0, self._long_rests(rows, steps[0], state)
        alike = 2 * rests + moves
        while begin < n:
            if state[begin] == EMPTY:
                begin += 1
                continue
            if state[begin] == FIRST:
                self._begin(rows[begin], steps[0, begin])
            end = _end(state, alike, begin)
            own = {run: each[begin:end] for run, each in given.items()}
            begin += self._run(own, begin, out, moves=bool(moves[begin]), rests=bool(rests[begin]))
            if out.reset[begin - 1]:
                self._pause = PAUSE
                self._wait(state[begin - 1 :])
        return out

    def _moves(self, rows: FloatArray, steps: FloatArray) -> BoolArray:
        """Whether the rig or its drive moves at each row, shape (n,)."""
        speed = np.abs(rows[:, self._rates]).max(axis=1, initial=0.0)
        return np.asarray((speed > self._slow) | steps.any(axis=1))

    def _long_rests(self, rows: FloatArray, steps: FloatArray, state: Codes) -> BoolArray:
        """Samples of a rest through which hidden states stay as they are, shape (n,)."""
        still = ~self._moves(rows, steps) & (state != EMPTY)
        rests = np.zeros(len(rows), np.bool_)
        for k in range(len(rows)):
            if state[k] == FIRST and still[k]:
                self._rested = self._settled
            else:
                rests[k] = still[k] and self._rested >= self._settled
                self._rested = self._rested + 1 if still[k] else 0
        return rests

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
        self._last = dict.fromkeys(Run, row.copy())
        if self._usual is not None and self._moves(row[None, :], steps[None, :])[0]:
            self._states = [self._usual] * len(Run)
            return
        still = np.repeat(row[None, :], round(SETTLING / self._dt), axis=0)
        still[:, self._rates] = 0.0
        for run, parameters in zip(Run, self._parameters, strict=True):
            self._states[run] = balanced(self._compiled, parameters, still, self._dt)

    def _run(self, rows: Rows, first: int, out: Predicted, *, moves: bool, rests: bool) -> int:
        """Run along the rows until they end or diverge; returns the number done.

        Args:
            rows: of each run.
            first: index of the first row.
            out: to be filled.
            moves: whether those with edges between samples differ from the plain ones.
            rests: whether hidden states stay as they are.
        """
        given = {run: np.concatenate([self._last[run][None, :], rows[run]]) for run in Run}
        different = [run for run in Run if moves or run != Run.MOVED]
        made = {run: self._simulated(run, given[run], rests=rests) for run in different}
        if not moves:
            made[Run.MOVED] = made[Run.PLAIN]
        parts = [made[run].outputs[:, 1:].reshape(-1, 1 + self.hidden) for run in Run]
        outputs = np.stack(parts, axis=1)
        # Also false for NaN; the hidden states are among the outputs.
        within = (np.abs(outputs) <= LARGEST).all(axis=(1, 2))
        if good := bool(within.all()):
            if not rests:
                self._states = [made[run].last[0] for run in Run]
            self._last = {run: own[-1].copy() for run, own in rows.items()}
        kept = len(outputs) if good else int(np.argmin(within))
        at, outputs = slice(first, first + kept), outputs[:kept]
        out.outputs[at], out.states[at] = outputs[..., 0], outputs[..., 1:]
        if good:
            return kept
        out.reset[first + kept] = True
        return kept + 1

    def _simulated(self, run: Run, inputs: FloatArray, *, rests: bool) -> Simulation:
        """One run along the rows; at rest one for each row, from the same hidden states."""
        begins = np.arange(len(inputs) - 1 if rests else 1)
        with np.errstate(over="ignore", invalid="ignore"):
            return self._compiled.simulate(
                inputs, self._dt, begins, 2 if rests else len(inputs),
                initial=np.repeat(self._states[run][None, :], len(begins), axis=0),
                parameters=self._parameters[run], substeps=SUBSTEPS,
            )  # fmt: skip


def _given(rows: FloatArray, steps: FloatArray, moved: FloatArray) -> Rows:
    """The rows of each run, see `AlongMotion.update`."""
    inputs = slice(moved.shape[1])
    changed = {run: rows.copy() for run in WITH_OTHER_INPUTS}
    changed[Run.WEAK][:, inputs] *= 1.0 - WEAKER
    changed[Run.LATE][:, inputs] -= LATER * steps[0]
    changed[Run.HELD_LATE][:, inputs] -= LATER * steps[1]
    changed[Run.MOVED][:, inputs] += moved
    return dict.fromkeys(Run, rows) | changed


def _end(state: Codes, alike: IntArray, begin: int) -> int:
    """Where a run of samples with a complete kernel ends; a change begins a new one."""
    for k in range(begin + 1, state.size):
        if alike[k] != alike[begin] or state[k] in (EMPTY, FIRST):
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
