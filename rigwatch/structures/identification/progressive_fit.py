"""Fits structures with unmeasured nodes: over ever longer parts of the record, from its start.

Windows in the middle of a record need initial states from the data, and noise hides those of nodes
without a signal. Instead one trajectory starts at the record's beginning, where states are known or
few. Each part is half as long again as the last, so that the last estimate keeps the trajectory in
phase with the record. If the first part is too short its estimates are poor; if it is too long the
guess is out of phase. Several lengths are tried, and the smallest error wins.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.structures.identification.least_squares import Step
from rigwatch.structures.identification.problem import Problem
from rigwatch.structures.identification.whole_record import WholeRecord
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

FIRST = (4.0, 8.0, 2.0, 16.0)
"""Lengths of the first part, in periods of the fastest motion, the most promising first."""
GROWTH = 1.5
STEPS = 8
"""Most Gauss-Newton steps over each part but the last."""
ENOUGH = 2
"""Lengths that must reach the same error before the others are skipped."""
SAME = 1.01


@dataclass(frozen=True, eq=False)
class Followed:
    """A fitted trajectory over the whole record.

    Attributes:
        turns: unknowns after each part, then after each step over the whole record.
        step: the last linear problem.
        cost: sum of the squared errors over the spread of each signal.
    """

    turns: list[FloatArray]
    step: Step
    cost: float


def followed(problem: Problem, iterations: int, scale: FloatArray | None) -> Followed | None:
    """The best trajectory over the whole record; None if none converged.

    Args:
        problem: the identification problem.
        iterations: largest number over the whole record.
        scale: standard deviation of each output's noise; from the residuals if None.
    """
    ends: list[Followed] = []
    for first in _lengths(problem):
        end = _prolonged(problem, first, iterations, scale)
        if end is not None:
            ends.append(end)
            least = min(one.cost for one in ends)
            if sum(one.cost <= SAME * least for one in ends) >= ENOUGH:
                break
    return min(ends, key=lambda one: one.cost, default=None)


def _lengths(problem: Problem) -> Iterator[int]:
    samples = len(problem.recording) - problem.first
    period = 2 * np.pi / max(problem.speed.whole, 1e-9) / problem.recording.dt
    for periods in FIRST:
        yield int(min(max(np.ceil(periods * period), len(problem.names) + 1), samples))


def _prolonged(
    problem: Problem, first: int, iterations: int, scale: FloatArray | None
) -> Followed | None:
    samples = len(problem.recording) - problem.first
    length, now, turns = first, problem.guess, list[FloatArray]()
    try:
        while length < samples:
            found, _, _ = WholeRecord(_beginning(problem, length), scale).refined(now, STEPS)
            turns += found[-1:]
            now = turns[-1] if turns else now
            length = int(np.ceil(GROWTH * length))
        whole = WholeRecord(problem, scale)
        found, step, good = whole.refined(now, iterations)
    except ModelError:
        return None
    if not good:
        return None
    turns += found or [now]
    return Followed(turns, step, whole.spread_cost(turns[-1]))


def _beginning(problem: Problem, samples: int) -> Problem:
    recording, last = problem.recording, problem.first + samples
    part = recording.stretch(0, last)
    return replace(problem, recording=part, weight=problem.weight[:samples])
