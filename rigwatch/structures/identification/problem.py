"""What every method of identification is given: equations, a record, and what is unknown.

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

from rigwatch.physics.engine.equations import Model, compose
from rigwatch.physics.engine.fit import Recording, initial_states
from rigwatch.structures.identification.sweep import Sweeper, sweeper
from rigwatch.structures.model import Structure, coefficients, to_model, with_unknowns
from rigwatch.structures.records import Record, weights
from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import unit_of

TURN = 0.1
"""Radians of the fastest motion per integration step of the methods that may choose it."""
LOAD_TURN = 0.5
"""The same for the fastest sine among the loads, which only has to be averaged well."""
MOST_SUBSTEPS = 256


class Speed(NamedTuple):
    """How fast a model moves about the record.

    Attributes:
        whole: largest eigenvalue of its Jacobian, decay included [rad/s].
        turning: of its oscillations [rad/s].
        growing: largest rate at which a disturbance grows [1/s]; 0 where all is stable.
    """

    whole: float
    turning: float
    growing: float


@dataclass(frozen=True, eq=False)
class Problem:
    """One identification.

    Attributes:
        sweeper: the compiled equations.
        recording: inputs and outputs, whole.
        first: first sample that counts.
        start: all parameters, guesses where unknown, shape (n_p,).
        initial: states at `first`, guesses where unknown, shape (n,).
        loose: which of them are unknown, shape (k,).
        weight: of each sample from `first` on, shape (samples,).
        substeps: integration steps a sample, where a method may choose.
        speed: of the fastest motion at the guess.
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
    def names(self) -> tuple[str, ...]:
        """The unknowns: free parameters, then initial states."""
        system = self.sweeper.compiled.system
        states = list(system.states)
        return (*system.free, *(f"{states[index]}(0)" for index in self.loose))

    @property
    def free(self) -> IntArray:
        """Places of the free parameters among all of them, shape (m,)."""
        names = list(self.sweeper.compiled.system.parameters)
        return np.array([names.index(n) for n in self.sweeper.compiled.system.free], np.int64)

    @property
    def guess(self) -> FloatArray:
        """Where the unknowns start, shape (m + k,)."""
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
        """States as the record shows them, whole, shape (all samples, n)."""
        return initial_states(self.sweeper.compiled.system, self.recording)

    @cached_property
    def hidden(self) -> NDArray[np.bool_]:
        """States of nodes of which the record holds neither position nor velocity, shape (n,)."""
        system, outputs = self.sweeper.compiled.system, self.recording.outputs
        there = [bool(np.isfinite(column).any()) for column in outputs.T]
        channels = {
            output.channel or name
            for (name, output), seen in zip(system.model.outputs.items(), there, strict=True)
            if seen
        }
        states = system.states.values()
        return ~np.array([s.measured in channels or s.rate_of in channels for s in states], bool)

    def split(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """All parameters and initial states with the unknowns in their places."""
        parameters, initial = self.start.copy(), self.initial.copy()
        count = len(self.free)
        parameters[self.free], initial[self.loose] = unknowns[:count], unknowns[count:]
        return parameters, initial

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
    """The identification of `unknowns` from a record.

    Args:
        subject: a structure, or any model of the engine.
        record: what was measured.
        unknowns: names; those that the file marks as unknown if None.
        guess: where they start; the file's guesses where left out.
        weighting: see `weighting.weights`.
        first: first sample that counts; with another than 0, every initial state that is unknown
            has to be named, and starts where the record shows it.
        substeps: integration steps a sample, chosen from the fastest motion if None.

    Raises:
        ModelError: a name is unknown, nothing is unknown, or the record is too coarse or too short.
    """
    model, start_names = _model(subject, unknowns, guess or {})
    tools = sweeper(compose(model))
    recording = record.recording(model)
    states = list(tools.compiled.system.states)
    loose = np.array([states.index(name.removesuffix("(0)")) for name in start_names], np.int64)
    if not len(tools.compiled.system.free) + len(loose):
        raise ModelError(f"{model.name}: found nothing that is unknown, expected some")
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
    """The fastest motion at the guess, about some of the states that the record shows."""
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
        ModelError: it does; the message says which step would do.
    """
    dt = problem.recording.dt
    if omega * dt > limit:
        raise ModelError(
            f"{problem.sweeper.compiled.system.model.name}: found a time step of {dt:g} s, expected"
            f" at most {limit / omega:.2g} s: {reason} for its fastest motion of {omega:.3g} rad/s"
        )


def _substeps(problem: Problem, omega: float) -> int:
    """Integration steps a sample, for the fastest motion and the fastest sine of the loads."""
    system, dt = problem.sweeper.compiled.system, problem.recording.dt
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
            f"{problem.sweeper.compiled.system.model.name}: found {len(problem.names)} unknowns and"
            f" {valid} samples, expected at least as many samples"
        )


def _model(
    subject: Structure | Model, unknowns: Sequence[str] | None, guess: Mapping[str, float]
) -> tuple[Model, list[str]]:
    """The model with exactly the wanted parameters free, and the unknown initial states."""
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
    # A person guesses in the unit that the model's file is written in.
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
    """States at the first sample: as the model starts, or as the record shows unknown ones."""
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
