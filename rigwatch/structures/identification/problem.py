"""The input of every identification method: equations, a record, and the unknowns.

Unknowns are parameters of the model, by name, and initial states, called x6(0) and v6(0).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigwatch.physics.engine.equations import Model, System, compose
from rigwatch.physics.engine.fit import Recording, initial_states
from rigwatch.structures.identification.sweep import Sweeper, sweeper
from rigwatch.structures.model import Structure, coefficients, to_model, with_unknowns
from rigwatch.structures.records import Record, weights
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import unit_of

TURN = 0.1
"""Phase of the fastest motion per integration step, for methods that may choose the step [rad]."""
LOAD_TURN = 0.5
"""The same for the fastest sine among the loads, which only needs to be averaged well."""
MOST_SUBSTEPS = 256


class Speed(NamedTuple):
    """Time scales of a model along the record.

    Attributes:
        whole: largest eigenvalue of the Jacobian, decay included [rad/s].
        turning: fastest oscillation [rad/s].
        growing: largest growth rate of a disturbance [1/s]; 0 if stable.
    """

    whole: float
    turning: float
    growing: float


@dataclass(frozen=True, eq=False)
class Problem:
    """One identification problem.

    Attributes:
        sweeper: the compiled equations.
        recording: all inputs and outputs.
        first: first sample used.
        start: all parameters, with guesses for unknowns, shape (n_p,).
        initial: states at `first`, with guesses for unknowns, shape (n,).
        loose: indices of the unknown initial states, shape (k,).
        weight: of each sample from `first` on, shape (samples,).
        substeps: integration steps per sample, for methods that may choose.
        speed: fastest motion at the guess.
    """

    sweeper: Sweeper
    recording: Recording
    first: int
    start: FloatArray
    initial: FloatArray
    loose: IntArray
    weight: FloatArray
    substeps: int
    speed: Speed

    @property
    def system(self) -> System:
        """The equations."""
        return self.sweeper.compiled.system

    @property
    def names(self) -> tuple[str, ...]:
        """The unknowns: free parameters, then initial states."""
        states = list(self.system.states)
        return (*self.system.free, *(f"{states[index]}(0)" for index in self.loose))

    @property
    def free(self) -> IntArray:
        """Indices of the free parameters, shape (m,)."""
        names = list(self.system.parameters)
        return np.array([names.index(name) for name in self.system.free], np.int64)

    @property
    def guess(self) -> FloatArray:
        """Initial guesses of the unknowns, shape (m + k,)."""
        return np.concatenate([self.start[self.free], self.initial[self.loose]])

    @property
    def observed(self) -> FloatArray:
        """Outputs from `first` on, shape (samples, outputs)."""
        return self.recording.outputs[self.first :]

    @property
    def inputs(self) -> FloatArray:
        """Inputs from `first` on, shape (samples, inputs)."""
        return self.recording.inputs[self.first :]

    @cached_property
    def shown(self) -> FloatArray:
        """All states from the record, shape (all samples, n)."""
        return initial_states(self.system, self.recording)

    @cached_property
    def hidden(self) -> NDArray[np.bool_]:
        """States of nodes whose position and velocity are not in the record, shape (n,)."""
        system, outputs = self.system, self.recording.outputs
        there = [bool(np.isfinite(column).any()) for column in outputs.T]
        channels = {
            output.channel or name
            for (name, output), seen in zip(system.model.outputs.items(), there, strict=True)
            if seen
        }
        states = system.states.values()
        return ~np.array([s.measured in channels or s.rate_of in channels for s in states], bool)

    def split(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """All parameters and initial states, with the unknowns filled in."""
        parameters, initial = self.start.copy(), self.initial.copy()
        count = len(self.free)
        parameters[self.free], initial[self.loose] = unknowns[:count], unknowns[count:]
        return parameters, initial

    def bounded(self, values: FloatArray) -> FloatArray:
        """Values of the free parameters, shape (m,), clipped to their bounds."""
        free = [self.system.parameters[name] for name in self.system.free]
        return np.clip(values, [p.low for p in free], [p.high for p in free])

    def simulate(self, unknowns: FloatArray, substeps: int) -> tuple[FloatArray, FloatArray]:
        """Outputs from `first` on, and their derivatives by the unknowns.

        Returns:
            Shapes (samples, outputs) and (samples, outputs, m + k).
        """
        parameters, initial = self.split(unknowns)
        run = self.sweeper.compiled.simulate(
            self.recording.inputs,
            self.recording.dt,
            np.array([self.first]),
            len(self.recording) - self.first,
            initial=initial[None],
            parameters=parameters,
            substeps=substeps,
        )
        count = len(self.free)
        columns = [*range(count), *(count + self.loose).tolist()]
        return run.outputs[0], run.slopes[0][..., columns]


def problem_of(
    subject: Structure | Model,
    record: Record,
    unknowns: Sequence[str] | None = None,
    guess: Mapping[str, float] | None = None,
    *,
    weighting: str = "uniform",
    first: int = 0,
    substeps: int | None = None,
) -> Problem:
    """Set up the identification of `unknowns` from a record.

    Args:
        subject: a structure, or any model of the engine.
        record: the measurement.
        unknowns: names; those marked as unknown in the file if None.
        guess: initial guesses; the file's for those left out.
        weighting: see `weighting.weights`.
        first: first sample used; if it is not 0, every unknown initial state must be named, and
            starts from the record.
        substeps: integration steps per sample; chosen from the fastest motion if None.

    Raises:
        ModelError: a name is unknown, nothing is unknown, or the record is too coarse or too short.
    """
    model, start_names = _model(subject, unknowns, guess or {})
    tools = sweeper(compose(model))
    recording = record.recording(model)
    states = list(tools.compiled.system.states)
    loose = np.array([states.index(name.removesuffix("(0)")) for name in start_names], np.int64)
    if not len(tools.compiled.system.free) + len(loose):
        raise ModelError(
            f"{model.name}: found no unknown, expected at least one (`unknown = true` or --unknown)"
        )
    if first < 0 or len(recording) - first < 2:
        found = f"{len(recording) - first} samples from sample {first} on"
        raise ModelError(f"{model.name}: found {found}, expected at least 2")
    initial = _initial(tools, recording, first, loose, guess or {})
    time = np.arange(first, len(recording), dtype=np.float64) * np.float64(recording.dt)
    made = Problem(
        tools, recording, first, tools.compiled.parameters, initial, loose,
        weights(weighting, time), substeps or 1, Speed(0.0, 0.0, 0.0),
    )  # fmt: skip
    _require_samples(made)
    speed = _fastest(made)
    require_fine_enough(made, speed.turning, math.pi, "two samples a period")
    return replace(made, substeps=substeps or _substeps(made, speed.whole), speed=speed)


def _fastest(problem: Problem) -> Speed:
    """The fastest motion at the initial guess, linearised about some states of the record."""
    nominal = problem.shown[problem.first :]
    some = np.unique(np.linspace(0, len(nominal) - 1, 25).astype(int))
    _, slopes = problem.sweeper.rates(
        problem.inputs[some], problem.recording.dt, problem.first, nominal[some], problem.start
    )
    n = nominal.shape[1]
    if not n or not np.isfinite(slopes).all():
        return Speed(0.0, 0.0, 0.0)
    values = np.linalg.eigvals(slopes[..., -n:])
    growing = max(float(np.mean(values.real.max(axis=-1))), 0.0)
    return Speed(float(np.abs(values).max()), float(np.abs(values.imag).max()), growing)


def require_fine_enough(problem: Problem, omega: float, limit: float, reason: str) -> None:
    """Refuse a record whose step times `omega` [rad/s] exceeds `limit`.

    Raises:
        ModelError: it does; the message says which step suffices.
    """
    dt = problem.recording.dt
    if omega * dt > limit:
        raise ModelError(
            f"{problem.system.model.name}: found a time step of {dt:g} s, expected"
            f" at most {limit / omega:.2g} s: {reason} for its fastest motion of {omega:.3g} rad/s"
        )


def _substeps(problem: Problem, omega: float) -> int:
    """Integration steps per sample, for the fastest motion and the fastest sine of the loads."""
    system, dt = problem.system, problem.recording.dt
    loads = [
        abs(parameter.value)
        for name, parameter in system.parameters.items()
        if parameter.fixed and parameter.unit == "1/s" and "_omega" in name
    ]
    wanted = max(omega * dt / TURN, max(loads, default=0.0) * dt / LOAD_TURN)
    return min(max(1, math.ceil(wanted)), MOST_SUBSTEPS)


def _require_samples(problem: Problem) -> None:
    valid = int(np.isfinite(problem.observed).sum())
    if valid < len(problem.names):
        raise ModelError(
            f"{problem.system.model.name}: found {len(problem.names)} unknowns and"
            f" {valid} samples, expected at least as many samples"
        )


def _model(
    subject: Structure | Model, unknowns: Sequence[str] | None, guess: Mapping[str, float]
) -> tuple[Model, list[str]]:
    """The model with exactly the requested parameters free, and the unknown initial states."""
    if isinstance(subject, Structure):
        numbers = coefficients(subject)
        chosen = [n for n, c in numbers.items() if c.unknown] if unknowns is None else unknowns
        model = to_model(with_unknowns(subject, chosen, guess), ports=False)
    else:
        free = [name for name, p in subject.parameters.items() if not p.fixed]
        chosen = free if unknowns is None else unknowns
        model = _freed(subject, chosen, guess)
    if len(set(chosen)) < len(chosen):
        raise ModelError(f"{model.name}: found an unknown that is named twice")
    return model, [name for name in chosen if name.endswith("(0)")]


def _freed(model: Model, unknowns: Sequence[str], guess: Mapping[str, float]) -> Model:
    known = [*model.parameters, *(f"{state}(0)" for state in model.states)]
    for name in (*unknowns, *guess):
        if name not in known:
            raise ModelError(
                f"{model.name}: found the unknown {name!r}, expected one of {', '.join(known)}"
            )
    # Guesses are in the unit of the model's file.
    values = {
        name: unit_of(p.shown or p.unit).to_si(guess[name]) if name in guess else p.value
        for name, p in model.parameters.items()
    }
    parameters = {
        name: msgspec.structs.replace(p, fixed=name not in unknowns, value=values[name])
        for name, p in model.parameters.items()
    }
    return msgspec.structs.replace(model, parameters=parameters)


def _initial(
    tools: Sweeper, recording: Recording, first: int, loose: IntArray, guess: Mapping[str, float]
) -> FloatArray:
    """States at the first sample: the model's, or from the record if unknown."""
    system = tools.compiled.system
    known = np.array([state.start for state in system.states.values()], np.float64)
    if not len(known):
        return known
    shown = initial_states(system, recording)[first]
    found = shown if first else known
    found[loose] = shown[loose]
    for index, (name, state) in enumerate(system.states.items()):
        if f"{name}(0)" in guess:
            written = unit_of(state.shown or state.unit)
            found[index] = written.to_si(guess[f"{name}(0)"])
    return found
