"""Directions of candidates per recording, for effects with states on a model without states.

The states of an effect do not carry over from one recording to the next.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from rigwatch.physics.engine.fit import apart
from rigwatch.physics.engine.score import Candidate
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.study import Study

EXPECTED_PORT = (
    """[ports.load], kind = "force", unit, variables, and `+ load` in the equation of a rate"""
)
Along = Callable[[Data, Fitted, Sequence[Candidate]], tuple[FloatArray, FloatArray]]


def per_recording(
    along: Along, data: Data, base: Fitted, found: Sequence[Candidate]
) -> tuple[FloatArray, FloatArray]:
    """`along` for the whole of the training recordings.

    Args:
        along: returns directions of candidates (windows, samples, outputs, candidates) and slopes
            of the model by its free parameters, then by its initial states.
        data, base, found: arguments of `along`.
    """
    system = base.compiled.system
    if system.model.states or len(data.train.parts) < 2:
        return along(data, base, found)
    if system.states:
        return _one_by_one(along, data, base, found)
    # Effects without states keep continuous time across recordings, as in a fit.
    moved, slopes = along(data, base, found)
    stateful = [index for index, candidate in enumerate(found) if candidate.effect.states]
    if stateful:
        moved[..., stateful] = _one_by_one(along, data, base, [found[index] for index in stateful])[
            0
        ]
    return moved, slopes


def _one_by_one(
    along: Along, data: Data, base: Fitted, found: Sequence[Candidate]
) -> tuple[FloatArray, FloatArray]:
    """`along` for each recording separately; each has initial states of its own."""
    system, parts = base.compiled.system, data.train.parts
    pieces = zip(apart(data.train), _fits(base, len(parts)), strict=True)
    made = [along(replace(data, train=train), fitted, found) for train, fitted in pieces]
    free, states = len(system.free), len(system.states)
    moved = np.concatenate([piece for piece, _ in made], axis=1)
    slopes = np.zeros((*moved.shape[:3], free + states * len(parts)))
    first = 0
    for index, (_, own) in enumerate(made):
        rows = slice(first, first + own.shape[1])
        slopes[:, rows, :, :free] = own[..., :free]
        at = free + index * states
        slopes[:, rows, :, at : at + states] = own[..., free:]
        first += own.shape[1]
    return moved, slopes


def check_ports(study: Study) -> None:
    """Check that effects can enter the model.

    Raises:
        ModelError: the model has no port.
    """
    if not study.model.ports:
        raise ModelError(
            f"{study.file.model}: found no port, expected one where effects may enter:"
            f" {EXPECTED_PORT}"
        )


def _fits(base: Fitted, parts: int) -> list[Fitted]:
    """One fit per recording, each with that recording's initial state."""
    initial = base.train.initial
    if len(initial) != parts:
        return [base] * parts
    return [
        replace(base, train=replace(base.train, initial=initial[i : i + 1])) for i in range(parts)
    ]
