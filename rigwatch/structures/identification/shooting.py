"""Multiple shooting with exact sensitivities: short windows first, the whole record last.

Over a short window a trajectory cannot diverge from the record for any guess: there the fit
is almost linear in the unknowns. Each window's initial states are free and projected out. The
estimate is the guess for windows four times as long, and so on. The last window is the whole record
(`whole_record.py`).

A longer window is accepted as long as its errors match those over shorter ones. If they do not,
disturbances grow (an unstable plant, a strongly nonlinear structure that is chaotic), and the
longest accepted windows give the result.

For nodes without a signal, `progressive_fit.py` follows one trajectory from the record's start
instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigwatch.structures.identification.direct import solve as regression
from rigwatch.structures.identification.identify import Outcome, settled
from rigwatch.structures.identification.least_squares import FOUR_DIGITS, Step, require_determined
from rigwatch.structures.identification.problem import Problem
from rigwatch.structures.identification.progressive_fit import followed
from rigwatch.structures.identification.whole_record import WholeRecord
from rigwatch.structures.identification.windows import Windows
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

SHORTEST = 4
"""Samples of the shortest windows; a period of the guess's fastest motion if longer."""
GROWTH = 4
STEPS = 12
"""Most Gauss-Newton steps at each horizon but the last."""
WORSE = 1.25
"""Allowed growth of errors over longer windows: under noise alone they stay the same."""
SMALL = 2.0 * FOUR_DIGITS
"""Share of the signals below which errors are always small enough."""
MOST_GROWTH = 4.0
"""Natural logarithm of the largest growth of a disturbance within a window."""
UNCERTAIN = 0.5
"""Largest standard deviation of a determined unknown, relative to its size."""
FINEST = 1e-6
"""Relative change of the parameters at which the longest windows have converged."""
FOLLOWED = "longer trajectories part from the record: fitted over windows of {samples} samples"


def solve(
    problem: Problem,
    *,
    iterations: int = 30,
    partial: bool = False,
    scale: FloatArray | None = None,
) -> Outcome:
    """Fit over growing horizons, up to the whole record.

    Args:
        problem: the identification problem.
        iterations: largest number over the whole record.
        partial: name undetermined unknowns instead of refusing.
        scale: standard deviation of each output's noise; from the residuals if None.

    Raises:
        ModelError: the record does not determine the unknowns, and `partial` is not set.
    """
    with np.errstate(all="ignore"):
        outcome, step = _solved(problem, iterations, scale)
    if not partial:
        name = problem.system.model.name
        require_determined(problem.names, step.blind, name)
    return replace(outcome, undetermined=_uncertain(problem, outcome.iterations[-1], step))


def _solved(problem: Problem, iterations: int, scale: FloatArray | None) -> tuple[Outcome, Step]:
    """Fit over the whole record if it can be followed, else over windows."""
    tame = not _runs_away(problem)
    if tame and problem.hidden.any() and (found := _followed(problem, iterations, scale)):
        return found
    grown = _grown(problem)
    ended = None
    if tame and (grown.accepted or grown.windows is None):
        ended = _over_the_whole(problem, grown, iterations, scale)
    if ended is None and tame and not problem.hidden.any():
        # Heavy noise can look like a trajectory that diverges from the record.
        ended = _followed(problem, iterations, scale)
    return ended or _over_windows(problem, grown, iterations)


def _followed(
    problem: Problem, iterations: int, scale: FloatArray | None
) -> tuple[Outcome, Step] | None:
    """The final fit along one trajectory from the record's start; None if none converged."""
    found = followed(problem, iterations, scale)
    return (Outcome(found.turns, found.step.covariance, True), found.step) if found else None


@dataclass(eq=False)
class _Grown:
    """The progress of growing windows.

    Attributes:
        found: unknowns after each horizon.
        windows: the longest accepted windows, with all estimated parameters.
        accepted: whether every horizon was accepted.
    """

    found: list[FloatArray]
    windows: Windows | None
    parameters: FloatArray
    accepted: bool = True


def _grown(problem: Problem) -> _Grown:
    """Windows that grow until one is not accepted."""
    grown, count = _Grown([problem.guess], None, problem.start), len(problem.free)
    if not count:
        return grown
    starts = [problem.start, *_regressed(problem)]
    for horizon in _horizons(problem):
        tried = [Windows(problem, horizon) for _ in starts]
        ends = [one.refined(start, STEPS) for one, start in zip(tried, starts, strict=True)]
        best = cheapest([one.cost for one in tried])
        if grown.windows and not tried[best].rms <= max(WORSE * grown.windows.rms, SMALL):
            grown.accepted = False
            return grown
        grown.windows, grown.parameters, starts = tried[best], ends[best], [ends[best]]
        unknowns = grown.found[-1].copy()
        unknowns[:count] = ends[best][problem.free]
        grown.found.append(unknowns)
    return grown


def cheapest(costs: Sequence[float]) -> int:
    """The place of the least cost; windows that diverged cost NaN, or infinitely much."""
    return int(np.argmin(np.nan_to_num(costs, nan=np.inf)))


def _over_the_whole(
    problem: Problem, grown: _Grown, iterations: int, scale: FloatArray | None
) -> tuple[Outcome, Step] | None:
    """The final fit over the whole record; None if windows do better."""
    expected = np.inf
    if grown.windows and not len(problem.loose):
        expected = max(WORSE * grown.windows.rms, SMALL)
    whole = WholeRecord(problem, scale, expected)
    try:
        turns, step, good = whole.refined(grown.found[-1], iterations)
    except ModelError:
        if grown.windows is None:
            raise
        return None
    if not good and grown.windows and not len(problem.loose):
        return None
    return Outcome([*grown.found, *turns], step.covariance, good), step


def _over_windows(problem: Problem, grown: _Grown, iterations: int) -> tuple[Outcome, Step]:
    """The final fit over the longest accepted windows."""
    if len(problem.loose) or grown.windows is None:
        raise ModelError(
            f"{problem.system.model.name}: found trajectories that part from the"
            " record, which do not determine initial states; expected known ones"
        )
    near = grown.windows.refined(grown.parameters, iterations, FINEST)
    grown.windows.weigh(near)
    last = grown.windows.refined(near, iterations, FINEST)
    step = grown.windows.judged(last)
    found = last[problem.free]
    good = settled(found, found + step.change)
    remark = FOLLOWED.format(samples=grown.windows.length)
    return Outcome([*grown.found, found], step.covariance, good, (remark,)), step


def _runs_away(problem: Problem) -> bool:
    """Whether a disturbance grows too much over the whole record."""
    duration = (len(problem.recording) - problem.first) * problem.recording.dt
    return problem.speed.growing * duration > MOST_GROWTH


def _uncertain(problem: Problem, found: FloatArray, step: Step) -> tuple[str, ...]:
    deviation = np.sqrt(np.maximum(np.diag(step.covariance), 0.0))
    vague = step.blind | (deviation > UNCERTAIN * np.maximum(np.abs(found), 1e-300))
    return tuple(name for name, flag in zip(problem.names, vague, strict=True) if flag)


def _regressed(problem: Problem) -> list[FloatArray]:
    """All parameters from the direct approach, if it finds any: an alternative to the guess.

    It needs no simulation, so it works for any initial guess.
    """
    try:
        found = regression(replace(problem, loose=problem.loose[:0]))
    except (ModelError, np.linalg.LinAlgError):
        return []
    parameters = problem.start.copy()
    parameters[problem.free] = found.iterations[-1]
    return [parameters] if np.isfinite(parameters).all() else []


def _horizons(problem: Problem) -> list[int]:
    samples = len(problem.recording) - problem.first
    speed, dt = problem.speed, problem.recording.dt
    longest = samples / 2
    if speed.growing > 0:
        longest = min(longest, MOST_GROWTH / speed.growing / dt)
    period = 2 * np.pi / max(speed.whole, 1e-9) / dt
    horizon = int(max(min(np.ceil(period), longest), min(SHORTEST, samples)))
    found = [horizon]
    while found[-1] * GROWTH <= longest:
        found.append(found[-1] * GROWTH)
    return found
