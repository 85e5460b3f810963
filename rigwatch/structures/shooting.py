"""Multiple shooting with exact sensitivities: short windows first, the whole record last.

Over a short window a trajectory cannot part from the record, whatever the guess: there the fit is
almost linear in the unknowns. Each window's initial states are free and projected out. What is
found serves as the guess for windows four times as long, and so on. Last comes one window over the
whole record, with the initial states that are known held fixed, each signal counted by the noise
that it turned out to have.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rigwatch.structures.direct import solve as regression
from rigwatch.structures.identification import Outcome, settled
from rigwatch.structures.least_squares import Step, require_determined
from rigwatch.structures.least_squares import solve as least_squares
from rigwatch.structures.problem import Problem
from rigwatch.structures.windows import Windows
from rigwatch.wire.errors import ModelError

FloatArray = NDArray[np.float64]

SHORTEST = 4
"""Samples of the shortest windows; a period of the guess's fastest motion if longer."""
GROWTH = 4
STEPS = 12
"""Most Gauss-Newton steps at each horizon but the last."""
FOUR_DIGITS = 1e-4
"""Share of a signal's rms below which no signal's error is believed, whatever the fit says."""
FINER = 2
"""How much shorter the integration steps are over the whole record, where errors add up."""
SMALLEST = 1e-150
"""Noise of a signal that is always zero."""
MOST_GROWTH = 4.0
"""Natural logarithm of what a disturbance may grow by within a window."""
ROUNDING = 0.01
"""Share of the last step that may not matter where rounding keeps the errors from falling."""
HALVINGS = 12
UNCERTAIN = 0.5
"""Share of an unknown's size that its standard deviation may reach before it is named."""


def solve(
    problem: Problem,
    *,
    iterations: int = 30,
    partial: bool = False,
    scale: FloatArray | None = None,
) -> Outcome:
    """Grow the horizon to the whole record.

    Args:
        problem: what is unknown.
        iterations: most over the whole record.
        partial: name unknowns that the record does not determine instead of refusing.
        scale: standard deviation of each output's noise; from the residuals if None.

    Raises:
        ModelError: the record does not determine the unknowns, and `partial` is not set.
    """
    found = _grown(problem)
    if _unstable(problem):
        return _windowed(problem, found, iterations, partial)
    whole = _Whole(problem, scale)
    turns, step, good = whole.refined(found[-1], iterations)
    found += turns
    name = problem.sweeper.compiled.system.model.name
    if not partial:
        require_determined(problem.names, step.blind, name)
    return Outcome(found, step.covariance, good, (), _uncertain(problem, found[-1], step))


def _unstable(problem: Problem) -> bool:
    """Whether a disturbance would grow beyond use over the whole record."""
    duration = (len(problem.recording) - problem.first) * problem.recording.dt
    return problem.speed.growing * duration > MOST_GROWTH


def _windowed(problem: Problem, found: list[FloatArray], iterations: int, partial: bool) -> Outcome:
    """The end for a plant that runs away: windows only as long as it can be followed."""
    if len(problem.loose):
        raise ModelError(
            f"{problem.sweeper.compiled.system.model.name}: found a model that runs away, which"
            " does not determine initial states from the whole record; expected known ones"
        )
    parameters, _ = problem.split(found[-1])
    windows = Windows(problem, _horizons(problem)[-1])
    last = windows.refined(parameters, iterations, 1e-6)
    step = windows.judged(last)
    found.append(last[problem.free])
    if not partial:
        name = problem.sweeper.compiled.system.model.name
        require_determined(problem.names, step.blind, name)
    vague = _uncertain(problem, found[-1], step)
    remark = "the model runs away: fitted over windows with states of their own"
    return Outcome(
        found, step.covariance, settled(found[-1], found[-1] + step.change), (remark,), vague
    )


def _uncertain(problem: Problem, found: FloatArray, step: Step) -> tuple[str, ...]:
    deviation = np.sqrt(np.maximum(np.diag(step.covariance), 0.0))
    vague = step.blind | (deviation > UNCERTAIN * np.maximum(np.abs(found), 1e-300))
    return tuple(name for name, flag in zip(problem.names, vague, strict=True) if flag)


def _grown(problem: Problem) -> list[FloatArray]:
    """Unknowns after each horizon that is shorter than the record."""
    found, count = [problem.guess], len(problem.free)
    if not count or not problem.sweeper.compiled.system.states:
        return found
    starts = [problem.start, *_regressed(problem)]
    for horizon in _horizons(problem):
        tried = [Windows(problem, horizon) for _ in starts]
        ends = [one.refined(start, STEPS) for one, start in zip(tried, starts, strict=True)]
        starts = [ends[int(np.argmin([one.cost for one in tried]))]]
        unknowns = found[-1].copy()
        unknowns[:count] = starts[0][problem.free]
        found.append(unknowns)
    return found


def _regressed(problem: Problem) -> list[FloatArray]:
    """All parameters as the direct approach finds them, where it finds any: a rival of the guess.

    Nothing is simulated there, so that no guess is too far off for it.
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


@dataclass(eq=False)
class _Whole:
    """Damped Gauss-Newton over the whole record, counting each signal by its noise."""

    problem: Problem
    scale: FloatArray | None

    def refined(self, start: FloatArray, iterations: int) -> tuple[list[FloatArray], Step, bool]:
        """Unknowns after each step, the last linear problem, and whether they settled."""
        now, found, good = start, list[FloatArray](), False
        errors, slopes = self._errors(now)
        if not np.isfinite(slopes).all():
            raise ModelError(
                f"{self.problem.sweeper.compiled.system.model.name}: the simulation over the whole"
                " record leaves the finite numbers; try other guesses"
            )
        for _ in range(iterations):
            scale = self._noise(errors)
            step = least_squares(errors, slopes, self.problem.weight, scale)
            moved = self._shorter(now, step.change, errors, scale)
            if moved is None:
                good = settled(now, now + ROUNDING * step.change)
                break
            before, (now, errors, slopes) = now, moved
            found.append(now)
            if settled(before, now) and np.allclose(scale, self._noise(errors), rtol=0.02):
                good = True
                break
        scale = self._noise(errors)
        last = least_squares(errors, slopes, self.problem.weight, scale, least_variance=1.0)
        return found, last, good

    def _shorter(
        self, now: FloatArray, change: FloatArray, errors: FloatArray, scale: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """The step, halved until the error falls; None where no step is left that lowers it."""
        cost = self._cost(errors, scale)
        for _ in range(HALVINGS):
            moved = self._inside(now + change)
            new_errors, slopes = self._errors(moved)
            if np.isfinite(slopes).all() and self._cost(new_errors, scale) <= cost:
                return moved, new_errors, slopes
            change = change / 2
        return None

    def _inside(self, unknowns: FloatArray) -> FloatArray:
        system = self.problem.sweeper.compiled.system
        free = [system.parameters[name] for name in system.free]
        unknowns[: len(free)] = np.clip(
            unknowns[: len(free)], [p.low for p in free], [p.high for p in free]
        )
        return unknowns

    def _errors(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        outputs, slopes = self.problem.simulate(unknowns, FINER * self.problem.substeps)
        return self.problem.observed - outputs, slopes

    def _cost(self, errors: FloatArray, scale: FloatArray) -> float:
        return float(np.nansum(self.problem.weight[:, None] * (errors / scale) ** 2))

    def _noise(self, errors: FloatArray) -> FloatArray:
        """Standard deviation of each output's errors, not below four digits of the signal."""
        if self.scale is not None:
            return self.scale
        weight = self.problem.weight[:, None] * np.isfinite(errors)
        total = np.maximum(weight.sum(axis=0), 1e-300)
        found = np.sqrt((weight * np.nan_to_num(errors) ** 2).sum(axis=0) / total)
        size = np.sqrt((weight * np.nan_to_num(self.problem.observed) ** 2).sum(axis=0) / total)
        return np.asarray(np.maximum(np.maximum(found, FOUR_DIGITS * size), SMALLEST))
