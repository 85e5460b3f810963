"""The last stage of multiple shooting: one window over the whole record.

Known initial states are fixed, each signal is weighted by its estimated noise, and steps are halved
until the error falls.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.structures.identification.identify import settled
from rigwatch.structures.identification.least_squares import FOUR_DIGITS, Step
from rigwatch.structures.identification.least_squares import solve as least_squares
from rigwatch.structures.identification.problem import Problem
from rigwatch.structures.identification.windows import spreads
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

FINER = 2
"""Reduction of the integration step over the whole record, where errors accumulate."""
SMALLEST = 1e-150
"""Noise assumed for a signal that is always zero."""
ROUNDING = 0.01
"""Share of the last step that is negligible if rounding keeps the errors from falling."""
HALVINGS = 12
PATIENCE = 8
"""Steps after which the errors must have fallen to their level over windows."""


@dataclass(eq=False)
class WholeRecord:
    """Damped Gauss-Newton over the whole record, each signal weighted by its noise.

    Attributes:
        problem: the identification problem.
        scale: standard deviation of each output's noise; from the residuals if None.
        expected: rms error to reach, in standard deviations of each signal.
    """

    problem: Problem
    scale: FloatArray | None
    expected: float = np.inf

    def refined(self, start: FloatArray, iterations: int) -> tuple[list[FloatArray], Step, bool]:
        """Unknowns after each step, the last linear problem, and whether it converged."""
        now, found, good = start, list[FloatArray](), False
        errors, slopes = self._errors(now)
        if not np.isfinite(slopes).all():
            raise ModelError(
                f"{self.problem.system.model.name}: the simulation over the whole"
                " record diverges (NaN or infinite); try other guesses"
            )
        for turn in range(iterations):
            if turn >= PATIENCE and not self.consistent(errors):
                break
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
        return found, last, good and self.consistent(errors)

    def consistent(self, errors: FloatArray) -> bool:
        """Whether the errors are as small as those over windows."""
        share = errors / spreads(self.problem.observed)
        return bool(np.sqrt(np.nanmean(share**2)) <= self.expected)

    def spread_cost(self, unknowns: FloatArray) -> float:
        """Sum of the squared errors, each signal over its spread."""
        return self._cost(self._errors(unknowns)[0], spreads(self.problem.observed))

    def _shorter(
        self, now: FloatArray, change: FloatArray, errors: FloatArray, scale: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """The step, halved until the error falls; None if no step lowers it."""
        cost, count = self._cost(errors, scale), len(self.problem.free)
        for _ in range(HALVINGS):
            moved = now + change
            moved[:count] = self.problem.bounded(moved[:count])
            new_errors, slopes = self._errors(moved)
            if np.isfinite(slopes).all() and self._cost(new_errors, scale) <= cost:
                return moved, new_errors, slopes
            change = change / 2
        return None

    def _errors(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        outputs, slopes = self.problem.simulate(unknowns, FINER * self.problem.substeps)
        return self.problem.observed - outputs, slopes

    def _cost(self, errors: FloatArray, scale: FloatArray) -> float:
        return float(np.nansum(self.problem.weight[:, None] * (errors / scale) ** 2))

    def _noise(self, errors: FloatArray) -> FloatArray:
        """Standard deviation of each output's errors, at least four digits of the signal."""
        if self.scale is not None:
            return self.scale
        weight = self.problem.weight[:, None] * np.isfinite(errors)
        total = np.maximum(weight.sum(axis=0), 1e-300)
        found = np.sqrt((weight * np.nan_to_num(errors) ** 2).sum(axis=0) / total)
        size = np.sqrt((weight * np.nan_to_num(self.problem.observed) ** 2).sum(axis=0) / total)
        return np.asarray(np.maximum(np.maximum(found, FOUR_DIGITS * size), SMALLEST))
