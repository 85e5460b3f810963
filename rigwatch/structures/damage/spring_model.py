"""A structure whose spring coefficients are all free, with a record of it.

One kernel serves the undamaged structure and every candidate damage, as the stiffness, quadratic
and cubic coefficients of all springs are its free parameters. Its outputs are the observed signals,
then the positions and velocities of all other nodes, so that states can be read from them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from scipy.interpolate import CubicSpline

from rigwatch.physics.engine.fit import initial_states
from rigwatch.structures.identification import Problem, problem_of
from rigwatch.structures.model import Structure, coefficients, label, with_values
from rigwatch.structures.records import Record
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

KINDS = {"": "stiffness", "_quadratic": "quadratic", "_cubic": "cubic"}
"""What may change at a spring, by the suffix of its coefficient's name."""
FINER = 2
"""Integration steps per step of a fit; errors accumulate over the whole record."""
BETWEEN = 4
"""Steps between samples in the linear sweep along the record."""


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated stretch.

    Attributes:
        outputs: of the observed signals, shape (samples, m).
        slopes: derivatives by spring coefficients, then initial states, shape (samples, m, c + n).
        states: shape (samples, n).
    """

    outputs: FloatArray
    slopes: FloatArray
    states: FloatArray


@dataclass(frozen=True, eq=False)
class SpringModel:
    """A structure, its kernel and a record.

    Attributes:
        structure: its description.
        problem: kernel and record for the identification.
        signals: names of the observed signals in the record.
    """

    structure: Structure
    problem: Problem
    signals: tuple[str, ...]

    @property
    def candidates(self) -> tuple[str, ...]:
        """Names of the spring coefficients, in the order of the kernel's slopes."""
        return tuple(self.problem.system.free)

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        return self.problem.recording.dt

    @property
    def observed(self) -> FloatArray:
        """Shape (samples, m); NaN for invalid samples."""
        return self.problem.recording.outputs[:, : len(self.signals)]

    def __len__(self) -> int:
        return len(self.problem.recording)

    def vector(self, values: Mapping[str, float]) -> FloatArray:
        """All parameters, with those in `values` replaced; shape (n_p,)."""
        return self.problem.sweeper.compiled.vector(values)

    def value(self, parameters: FloatArray, name: str) -> float:
        """One of all parameters (n_p,), by its name."""
        return float(parameters[list(self.problem.system.parameters).index(name)])

    def changed(self, parameters: FloatArray, values: Mapping[str, float]) -> FloatArray:
        """All parameters (n_p,), with those in `values` replaced."""
        names, found = list(self.problem.system.parameters), parameters.copy()
        for name, value in values.items():
            found[names.index(name)] = value
        return found

    def columns(self, names: Sequence[str]) -> list[int]:
        """Columns of some spring coefficients, and of all states, in the kernel's slopes."""
        known, n = self.candidates, len(self.start())
        return [*(known.index(name) for name in names), *range(len(known), len(known) + n)]

    def start(self) -> FloatArray:
        """States at rest as the structure file has them, shape (n,)."""
        states = self.problem.system.states.values()
        return np.array([state.start for state in states], np.float64)

    def run(self, parameters: FloatArray, state: FloatArray, first: int, last: int) -> Run:
        """Simulate from `state` at sample `first` to the sample before `last`."""
        recording, system = self.problem.recording, self.problem.system
        made = self.problem.sweeper.compiled.simulate(
            recording.inputs, recording.dt, np.array([first]), last - first,
            initial=state[None], parameters=parameters, substeps=FINER * self.problem.substeps,
        )  # fmt: skip
        count, names = len(self.signals), list(system.outputs)
        places = [names.index(name) for name in system.states]
        outputs = made.outputs[0]
        return Run(outputs[:, :count], made.slopes[0][:, :count], outputs[:, places])

    def along_record(
        self, parameters: FloatArray, path: FloatArray, first: int, last: int
    ) -> tuple[FloatArray, FloatArray]:
        """Errors of the linear sweep along the observation, and their derivatives.

        Along the observed trajectory the response to a changed coefficient is linear in the change,
        however large it is; about the undamaged model's own trajectory it is not.

        Args:
            parameters: of the undamaged structure, shape (n_p,).
            path: states of nodes that are not observed, shape (samples of the record, n).
            first, last: the stretch [samples].

        Returns:
            Errors (last − first, m) and slopes (last − first, m, c + n) as of `run`.
        """
        recording = self.problem.recording
        nominal = self._observed_path(path)[first:last]
        fine = np.arange((last - first - 1) * BETWEEN + 1) / BETWEEN
        whole = np.arange(last - first, dtype=np.float64)
        smooth = CubicSpline(whole, nominal)(fine)
        inputs = [np.interp(fine, whole, u) for u in recording.inputs[first:last].T]
        driven = np.stack(inputs, axis=1) if inputs else np.zeros((len(fine), 0))
        swept = self.problem.sweeper.sweep(
            driven, recording.dt / BETWEEN, first * BETWEEN, smooth, parameters, smooth[0],
            np.arange(nominal.shape[1]),
        )  # fmt: skip
        count = len(self.signals)
        outputs, slopes = swept.outputs[::BETWEEN, :count], swept.slopes[::BETWEEN, :count]
        return self.observed[first:last] - outputs, slopes

    def shown_state(self, path: FloatArray, at: int) -> FloatArray:
        """States at a sample from the record, else from `path`, shape (n,)."""
        return np.asarray(self._observed_path(path)[at])

    def _observed_path(self, path: FloatArray) -> FloatArray:
        system, names = self.problem.system, self.signals
        shown = initial_states(system, self.problem.recording)
        for index, state in enumerate(system.states.values()):
            if state.measured not in names and state.rate_of not in names:
                shown[:, index] = path[:, index]
        return shown


def spring_model(
    structure: Structure, record: Record, values: Mapping[str, float] | None = None
) -> SpringModel:
    """The structure with its spring coefficients free, and `values` in place of the file's.

    Raises:
        ModelError: the record holds none of the structure's observed signals, or is too coarse.
    """
    signals = tuple(name for name in structure.signals if name in record.columns)
    if not signals:
        raise ModelError(
            f"{structure.name}: found a record of {', '.join(record.columns)}, expected at least"
            f" one of {', '.join(structure.signals)}"
        )
    every = [label(kind, node) for kind in "xv" for node in structure.nodes]
    hidden = tuple(name for name in every if name not in signals)
    whole = msgspec.structs.replace(
        with_values(structure, values or {}), observed=(*signals, *hidden)
    )
    numbers = coefficients(whole)
    names = [spring + end for spring in structure.springs for end in KINDS]
    guess = {name: numbers[name].value for name in names}
    # A sensor that is not listed as observed is ignored.
    kept = {name: column for name, column in record.columns.items() if name not in hidden}
    problem = problem_of(whole, Record(record.dt, kept), names, guess)
    return SpringModel(whole, problem, signals)


def with_record(model: SpringModel, record: Record) -> SpringModel:
    """The same kernel with another record of the same signals and time step."""
    equations = model.problem.system.model
    wanted = {*model.signals, *(i.channel or name for name, i in equations.inputs.items())}
    kept = {name: column for name, column in record.columns.items() if name in wanted}
    recording = Record(record.dt, kept).recording(equations)
    return replace(model, problem=replace(model.problem, recording=recording))


def split(name: str, structure: Structure) -> tuple[str, str]:
    """Spring and kind of a coefficient's name."""
    for ending, kind in reversed(KINDS.items()):
        spring = name.removesuffix(ending) if ending else name
        if name.endswith(ending) and spring in structure.springs:
            return spring, kind
    raise ModelError(f"{structure.name}: found {name!r}, expected a coefficient of a spring")
