"""One interface to every method that identifies unknowns from a record.

    found = identify("shooting", structure, record)
    found.parameters["k1_6"], found.intervals["k1_6"]

Each method is a function of a `Problem` that gives an `Outcome`; `METHODS` names them all.
"""

import importlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rigwatch.physics.engine.equations import Model
from rigwatch.structures.identification.problem import Problem, problem_of
from rigwatch.structures.model import Structure
from rigwatch.structures.records import Record
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

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
"""Relative change from one iteration to the next of what is the same to four digits."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a method found.

    Attributes:
        iterations: unknowns after each iteration, each of shape (m,).
        covariance: of the last, shape (m, m); None where the method knows none.
        converged: whether it settled.
        remarks: what a reader of the figures has to know.
        undetermined: unknowns that the record does not determine.
    """

    iterations: Sequence[FloatArray]
    covariance: FloatArray | None
    converged: bool
    remarks: tuple[str, ...] = ()
    undetermined: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Identification:
    """What a method found, by name.

    Attributes:
        method: its name.
        names: the unknowns, in order.
        iterations: after each iteration, shape (iterations, m).
        parameters: the last, by name.
        intervals: 95 % interval, by name; (nan, nan) where the method knows none.
        converged: whether it settled to four digits.
        seconds: time it took, compilation not counted [s].
        remarks: what a reader of the figures has to know.
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
    undetermined: tuple[str, ...] = field(default=())


def identify(
    method: str,
    structure: Structure | Model,
    record: Record,
    unknowns: Sequence[str] | None = None,
    guess: Mapping[str, float] | None = None,
    *,
    weighting: str = "uniform",
    first: int = 0,
    substeps: int | None = None,
    **options: Any,
) -> Identification:
    """Identify what is unknown of a structure from a record of its motion.

    Args:
        method: one of `METHODS`.
        structure: a structure, or any model of the engine.
        record: what was measured.
        unknowns: their names; those that the file marks if None.
        guess: where they start; the file's guesses where left out.
        weighting: uniform, exponential:SECONDS or jacobi:A,B.
        first: first sample that counts.
        substeps: integration steps a sample where the method chooses its own, automatic if None.
        options: of the method.

    Raises:
        ModelError: the method or a name is unknown, the record does not suit, or it cannot
            determine so many unknowns.
    """
    problem = problem_of(
        structure, record, unknowns, guess, weighting=weighting, first=first, substeps=substeps
    )
    return solved(method, problem, **options)


def solved(method: str, problem: Problem, **options: Any) -> Identification:
    """The result of a method on a prepared problem; errors as of `identify`."""
    solve = solver(method)
    started = time.perf_counter()
    outcome = solve(problem, **options)
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
    """Whether no unknown changed in its first four digits."""
    size = np.maximum(np.abs(after), 1e-9 * np.max(np.abs(after), initial=1e-300))
    return bool(np.all(np.abs(after - before) < SETTLED * size))


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
