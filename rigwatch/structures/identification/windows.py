"""Gauss-Newton over many short windows at once, each with free initial states.

For errors e_w of window w and its derivatives A_w by the parameters and B_w by its initial states,
one step solves min Σ_w |e_w − A_w·δp − B_w·δx_w|². The δx_w are projected out window by window
(Q_w·Q_wᵀ of B_w), which leaves a small problem in δp, and follow from δp. The windows' states are
iterated together with the parameters (lifted), so a step takes one simulation.
"""

from dataclasses import dataclass, replace

import numpy as np

from rigwatch.structures.identification.least_squares import FOUR_DIGITS, Step
from rigwatch.structures.identification.least_squares import solve as least_squares
from rigwatch.structures.identification.problem import Problem
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

ENOUGH = 1e-3
"""Relative change of the parameters that suffices as a guess for the next horizon."""
HALVINGS = 8


def spreads(signals: FloatArray) -> FloatArray:
    """Standard deviation of each column (samples, k) over valid samples; 1 if that is 0."""
    there = np.isfinite(signals)
    count = np.maximum(there.sum(axis=0), 1)
    mean = np.where(there, signals, 0.0).sum(axis=0) / count
    found = np.sqrt(np.where(there, (signals - mean) ** 2, 0.0).sum(axis=0) / count)
    return np.where(found > 0, found, 1.0)


@dataclass(frozen=True, eq=False)
class _Starts:
    """Singular vectors of the derivatives by the initial states, window by window."""

    left: FloatArray
    inverse: FloatArray

    @classmethod
    def of(cls, slopes: FloatArray) -> "_Starts":
        length = np.linalg.norm(slopes, axis=(0, 1))
        length = np.where(length > 0, length, 1.0)
        left, sizes, across = np.linalg.svd(slopes / length, full_matrices=False)
        seen = sizes > 1e-10 * sizes[:, :1]
        inverse = np.where(seen, 1.0 / np.where(seen, sizes, 1.0), 0.0)
        back = np.swapaxes(across, 1, 2) / length[:, None] * inverse[:, None, :]
        return cls(np.where(seen[:, None, :], left, 0.0), back)

    def without(self, columns: FloatArray) -> FloatArray:
        """The part of `columns` (windows, k, c) that no initial states explain."""
        return np.asarray(columns - self.left @ (np.swapaxes(self.left, 1, 2) @ columns))

    def solved(self, errors: FloatArray) -> FloatArray:
        """The initial states that best explain `errors` (windows, k), shape (windows, n)."""
        along = np.einsum("wki,wk->wi", self.left, errors)
        return np.asarray(np.einsum("wni,wi->wn", self.inverse, along))


@dataclass(eq=False)
class Windows:
    """A record cut into windows of equal length.

    Attributes:
        cost: sum of the scaled squares of the errors after the last refinement.
    """

    problem: Problem
    length: int
    cost: float = np.inf

    def __post_init__(self) -> None:
        problem, length = self.problem, self.length
        last = len(problem.recording) - length + 1
        # No sample is in two windows: its error would count twice.
        self._starts = np.arange(problem.first, last, length, dtype=np.int64)
        rows = self._starts[:, None] + np.arange(length)
        self._measured = problem.recording.outputs[rows]
        self._initial = problem.shown[self._starts]
        weight = problem.weight[rows - problem.first]
        self._there = np.where(np.isfinite(self._measured), np.sqrt(weight)[..., None], 0.0)
        self._factor = self._there / spreads(problem.observed)
        self._least = FOUR_DIGITS**2

    @property
    def rms(self) -> float:
        """Root mean square error after the last refinement, in standard deviations of a signal."""
        used = int((self._factor > 0).sum()) - self._initial.size - len(self.problem.free)
        return float(np.sqrt(self.cost / max(used, 1)))

    def refined(self, parameters: FloatArray, most: int, enough: float = ENOUGH) -> FloatArray:
        """Improved free parameters; takes and returns all of them, shape (n_p,).

        A step that diverges (NaN or infinite), or does not lower the errors, is discarded.
        """
        free = self.problem.free
        now, errors, slopes = parameters, *self._run(parameters, self._initial)
        self.cost = float(np.sum(errors**2))
        for _ in range(most):
            if not np.isfinite(slopes).all():
                return parameters
            change, shift = self._step(errors, slopes)
            moved = self._shorter(now, change, shift, errors)
            if moved is None:
                break
            before, (now, self._initial, errors, slopes) = now, moved
            self.cost = float(np.sum(errors**2))
            if np.all(np.abs(now - before)[free] <= enough * np.abs(now[free])):
                break
        return now

    def weigh(self, parameters: FloatArray) -> None:
        """From now on weight each signal by its estimated noise, not by its spread.

        Equal weights for signals of unequal noise give intervals that are too narrow.
        """
        errors, slopes = self._run(parameters, self._initial)
        if not np.isfinite(slopes).all():
            return
        size = spreads(self.problem.observed)
        share = errors.reshape(self._factor.shape)
        used = np.maximum((self._factor > 0).sum(axis=(0, 1)), 1)
        noise = np.sqrt((share**2).sum(axis=(0, 1)) / used)
        self._factor = self._there / (size * np.maximum(noise, FOUR_DIGITS))
        self._least = 1.0

    def _run(self, parameters: FloatArray, initial: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Scaled errors (windows, k) and slopes (windows, k, m + n)."""
        problem = self.problem
        run = problem.sweeper.compiled.simulate(
            problem.recording.inputs, problem.recording.dt, self._starts, self.length,
            initial=initial, parameters=parameters, substeps=problem.substeps,
        )  # fmt: skip
        errors = np.where(self._factor > 0, self._measured - run.outputs, 0.0) * self._factor
        slopes = run.slopes * self._factor[..., None]
        flat = errors.reshape(len(errors), -1)
        return flat, slopes.reshape(*flat.shape, -1)

    def _step(self, errors: FloatArray, slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Changes of the free parameters (m,) and of the initial states (windows, n)."""
        count = len(self.problem.free)
        starts = _Starts.of(slopes[..., count:])
        clean = starts.without(slopes[..., :count]).reshape(-1, count)
        rest = starts.without(errors[..., None]).ravel()
        size = np.linalg.norm(clean, axis=0)
        size = np.where(size > 0, size, 1.0)
        change = np.linalg.lstsq(clean / size, rest, rcond=1e-9)[0] / size
        return change, starts.solved(errors - slopes[..., :count] @ change)

    def judged(self, parameters: FloatArray) -> Step:
        """The last linear problem at the result of `refined`, with its covariance.

        Raises:
            ModelError: a window's trajectory diverges (NaN or infinite).
        """
        errors, slopes = self._run(parameters, self._initial)
        if not np.isfinite(slopes).all():
            name = self.problem.system.model.name
            raise ModelError(
                f"{name}: found no trajectories that follow the record, expected other guesses or"
                " more signals"
            )
        count = len(self.problem.free)
        starts = _Starts.of(slopes[..., count:])
        clean = starts.without(slopes[..., :count]).reshape(-1, 1, count)
        rest = starts.without(errors[..., None]).reshape(-1, 1)
        used = int((self._factor > 0).sum())
        left = max(used - self._initial.size - count, 1)
        least = self._least * left / max(len(rest) - count, 1)
        step = least_squares(rest, clean, np.ones(len(rest)), np.ones(1), least_variance=least)
        return replace(step, covariance=step.covariance * (len(rest) - count) / left)

    def _shorter(
        self, now: FloatArray, change: FloatArray, shift: FloatArray, errors: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
        """The step, halved until the errors fall; None if none lowers them."""
        cost = float(np.sum(errors**2))
        for _ in range(HALVINGS):
            moved = self._inside(now, change)
            new_errors, slopes = self._run(moved, self._initial + shift)
            if np.isfinite(slopes).all() and float(np.sum(new_errors**2)) <= cost:
                return moved, self._initial + shift, new_errors, slopes
            change, shift = change / 2, shift / 2
        return None

    def _inside(self, now: FloatArray, change: FloatArray) -> FloatArray:
        moved, free = now.copy(), self.problem.free
        moved[free] = self.problem.bounded(now[free] + change)
        return moved
