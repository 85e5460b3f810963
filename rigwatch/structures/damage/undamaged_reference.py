"""The undamaged structure: its unknowns, identified from the record's undamaged start.

Also its residual there (noise), and the covariance of the identified coefficients: both determine
which residual is to be expected later.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigwatch.structures.damage.detector import noise
from rigwatch.structures.damage.spring_model import SpringModel, spring_model, with_record
from rigwatch.structures.identification import CONFIDENCE, problem_of, solver
from rigwatch.structures.model import Structure, coefficients
from rigwatch.structures.records import Record
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

NEAR = 0.1
"""Change of an iteration, in standard deviations, at which it has converged."""
LEAST = 20
"""Fewest undamaged samples for an estimate of the noise."""


@dataclass(frozen=True)
class Figure:
    """A coefficient with its 95 % interval; both ends NaN if it is taken as known."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Reference:
    """The undamaged structure.

    Attributes:
        model: structure and record.
        parameters: all of them, shape (n_p,).
        figures: the identified coefficients, those marked as unknown in the file.
        spread: covariance of the spring coefficients and the first state, shape (c + n, c + n).
        sigma: standard deviation of each signal's noise, shape (m,).
        samples: number of undamaged samples used.
        freedom: valid ones of each signal, less what was identified from them: what `sigma` is of.
        unjudged: sensors that the undamaged start says too little of; the model leaves them out.
    """

    model: SpringModel
    parameters: FloatArray
    figures: Mapping[str, Figure]
    spread: FloatArray
    sigma: FloatArray
    samples: int
    freedom: int
    unjudged: tuple[str, ...] = ()


def reference(
    structure: Structure,
    record: Record,
    undamaged: float,
    *,
    known: bool = False,
    moving: bool = False,
    model: SpringModel | None = None,
) -> Reference:
    """The structure identified from the first `undamaged` seconds of the record.

    Args:
        structure: the description; its unknowns are identified.
        record: the whole record.
        undamaged: length of the undamaged start [s].
        known: take the file's values as true instead of identifying.
        moving: identify also where every node is and how fast at the first sample.
        model: the structure with another record, to reuse its kernel if `known` is set.

    Raises:
        ModelError: the undamaged start is too short, holds too little of every sensor, or does not
            determine the unknowns.
    """
    samples = round(undamaged / record.dt)
    if not LEAST <= samples <= len(record):
        raise ModelError(
            f"{structure.name}: found {undamaged:g} s of undamaged record, expected between"
            f" {LEAST * record.dt:g} and {len(record) * record.dt:g} s"
        )
    record, unjudged = _judged(structure, record, samples)
    unknowns = _unknowns(structure, known=known, moving=moving)
    names, values, covariance = _identified(structure, record, samples, unknowns)
    there = tuple(name for name in structure.signals if name in record.columns)
    if not unknowns and model is not None and model.signals == there:
        model = with_record(model, record)
    else:
        model = spring_model(structure, record, dict(zip(names, values.tolist(), strict=True)))
    parameters = model.problem.start
    run = model.run(parameters, model.start(), 0, samples)
    observed = model.observed[:samples]
    residual = run.outputs - observed
    sigma = noise(residual, observed, len(names))
    left = int(np.isfinite(residual).sum()) - len(names)
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    half = (CONFIDENCE * deviations).tolist()
    figures = {
        name: Figure(value, value - width, value + width)
        for name, value, width in zip(names, values.tolist(), half, strict=True)
        if not (moving and name.endswith("(0)"))
    }
    spread, freedom = _spread(model, names, covariance), max(left // len(sigma), 1)
    return Reference(model, parameters, figures, spread, sigma, samples, freedom, unjudged)


def _judged(structure: Structure, record: Record, samples: int) -> tuple[Record, tuple[str, ...]]:
    """The record without the sensors whose noise its first samples do not show; and their names."""
    there = [name for name in structure.signals if name in record.columns]
    dropped = tuple(name for name in there if not _tells(record.columns[name][:samples]))
    if there and len(dropped) == len(there):
        raise ModelError(
            f"{structure.name}: found no undamaged sensor of {', '.join(there)} with {LEAST}"
            " samples that are not all 0, expected at least one whose noise they show"
        )
    kept = {name: column for name, column in record.columns.items() if name not in dropped}
    return Record(record.dt, kept), dropped


def _tells(values: FloatArray) -> bool:
    """Whether undamaged samples of a sensor show its noise: a few, and not nothing but 0."""
    there = np.isfinite(values)
    return bool(there.sum() >= LEAST and np.any(values[there]))


def _unknowns(structure: Structure, *, known: bool, moving: bool) -> list[str]:
    """Names of what is identified: what the file marks, and if moving the first state."""
    return [
        name
        for name, number in coefficients(structure).items()
        if (moving and name.endswith("(0)")) or (number.unknown and not known)
    ]


def _identified(
    structure: Structure, record: Record, samples: int, unknowns: Sequence[str]
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Names, values and covariance of the unknowns."""
    if not unknowns:
        return (), np.zeros(0), np.zeros((0, 0))
    start = Record(record.dt, {name: column[:samples] for name, column in record.columns.items()})
    problem = problem_of(structure, start, unknowns)
    outcome = solver("shooting")(problem)
    covariance, turns = outcome.covariance, outcome.iterations
    if covariance is None or not (outcome.converged or _settled(turns, covariance)):
        raise ModelError(
            f"{structure.name}: found no parameters that explain the undamaged"
            f" {samples * record.dt:g} s, expected other guesses or a longer undamaged start"
        )
    return problem.names, turns[-1], covariance


def _settled(turns: Sequence[FloatArray], covariance: FloatArray) -> bool:
    """Whether the last iteration changed less than the standard deviations."""
    if len(turns) < 2:
        return False
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return bool(np.all(np.abs(turns[-1] - turns[-2]) <= NEAR * deviations))


def _spread(model: SpringModel, names: tuple[str, ...], covariance: FloatArray) -> FloatArray:
    """The covariance, expanded to all spring coefficients and states."""
    states = [f"{state}(0)" for state in model.problem.system.states]
    places = {name: index for index, name in enumerate((*model.candidates, *states))}
    spread = np.zeros((len(places), len(places)))
    kept = [index for index, name in enumerate(names) if name in places]
    at = [places[names[index]] for index in kept]
    spread[np.ix_(at, at)] = covariance[np.ix_(kept, kept)]
    return spread
