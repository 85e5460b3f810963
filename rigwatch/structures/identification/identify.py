"""One interface to all identification methods.

    found = identify("shooting", structure, record)
    found.parameters["k1_6"], found.intervals["k1_6"]

Each method is a function from a `Problem` to an `Outcome`; `METHODS` lists them.
"""

import importlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigwatch.physics.engine.equations import Model
from rigwatch.structures.identification.problem import Problem, problem_of
from rigwatch.structures.model import Structure
from rigwatch.structures.records import Record
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError, one_line

METHODS: dict[str, str] = {
    # name: module with `solve(problem, ...) -> Outcome`
    "quasilinearization": "quasilinear",
    "direct": "direct",
    "gauss-newton": "gauss_newton",
    "kalman": "kalman",
    "shooting": "shooting",
}
CONFIDENCE = 1.959964
"""Standard deviations on each side of a 95 % interval."""
SETTLED = 5e-5
"""Relative change between iterations below which four digits are stable."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """The outcome of a method.

    Attributes:
        iterations: unknowns after each iteration, each of shape (m,).
        covariance: of the last iteration, shape (m, m); None if the method gives none.
        converged: whether it converged.
        remarks: caveats for the reader.
        undetermined: unknowns that the record does not determine.
    """

    iterations: Sequence[FloatArray]
    covariance: FloatArray | None
    converged: bool
    remarks: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Identification:
    """The result of an identification, by name.

    Attributes:
        method: its name.
        names: the unknowns, in order.
        iterations: after each iteration, shape (iterations, m).
        parameters: the final values, by name.
        intervals: 95 % intervals, by name; (nan, nan) if the method gives none.
        converged: whether four digits are stable.
        seconds: run time without compilation [s].
        remarks: caveats for the reader.
        undetermined: unknowns that the record does not determine.
    """

    method: str
    names: tuple[str, ...]
    iterations: FloatArray
    parameters: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    converged: bool
    seconds: float
    remarks: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()


def identify(
    method: str,
    structure: Structure | Model,
    record: Record,
    unknowns: Sequence[str] | None = None,
    guess: Mapping[str, float] | None = None,
    *,
    weighting: str = "uniform",
    **options: Any,
) -> Identification:
    """Identify the unknowns of a structure from a record of its motion.

    Args:
        method: one of `METHODS`.
        structure: a structure, or any model of the engine.
        record: the measurement.
        unknowns: their names; those marked in the file if None.
        guess: initial guesses; the file's for those left out.
        weighting: uniform, exponential:SECONDS or jacobi:A,B.
        options: options of the method.

    Raises:
        ModelError: the method or a name is unknown, the record is unsuitable, or it cannot
            determine that many unknowns.
    """
    problem = problem_of(structure, record, unknowns, guess, weighting=weighting)
    return solved(method, problem, **options)


def solved(method: str, problem: Problem, **options: Any) -> Identification:
    """The result of a method on a prepared problem; errors as in `identify`.

    Raises:
        ModelError: the method's numbers ended it, as a matrix that cannot be inverted does.
    """
    solve = solver(method)
    started = time.perf_counter()
    try:
        outcome = solve(problem, **options)
    except (ArithmeticError, ValueError) as error:  # also of linear algebra
        name = problem.system.model.name
        raise ModelError(f"{name}: {method} cannot go on: {one_line(error)}") from error
    return _named(method, problem, outcome, time.perf_counter() - started)


def solver(method: str) -> Callable[..., Outcome]:
    """The function of a method.

    Raises:
        ModelError: there is no such method.
    """
    if method not in METHODS:
        raise ModelError(f"method: found {method!r}, expected one of {', '.join(METHODS)}")
    module = importlib.import_module(f"rigwatch.structures.identification.{METHODS[method]}")
    solve: Callable[..., Outcome] = module.solve
    return solve


def settled(before: FloatArray, after: FloatArray) -> bool:
    """Whether the first four digits of every unknown are stable."""
    size = np.maximum(np.abs(after), 1e-9 * np.max(np.abs(after), initial=1e-300))
    return bool(np.all(np.abs(after - before) < SETTLED * size))


def unsettled(iterations: int) -> str:
    """The remark of a method that has used up its iterations."""
    return f"four digits are not stable after {iterations} iterations"


def _named(method: str, problem: Problem, outcome: Outcome, seconds: float) -> Identification:
    names, last = problem.names, outcome.iterations[-1]
    if outcome.covariance is None:
        half = np.full(len(names), np.nan)
    else:
        half = CONFIDENCE * np.sqrt(np.maximum(np.diag(outcome.covariance), 0.0))
    return Identification(
        method,
        names,
        np.array(outcome.iterations),
        dict(zip(names, last.tolist(), strict=True)),
        {
            name: (value - width, value + width)
            for name, value, width in zip(names, last.tolist(), half.tolist(), strict=True)
        },
        outcome.converged,
        seconds,
        outcome.remarks,
        outcome.undetermined,
    )
