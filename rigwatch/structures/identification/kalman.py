"""Extended Kalman filter with weighted global iteration (Hoshiya and Saito 1984; Imai; thesis 2.1).

The augmented state X = {x, a} is predicted and corrected sample by sample,

    X(k+1/k) by integration,   P(k+1/k) = Φ·P·Φᵀ + W                                 (2.37), (2.38)
    K = P·Hᵀ·(H·P·Hᵀ + V)⁻¹,   P ← (I − K·H)·P·(I − K·H)ᵀ + K·V·Kᵀ                   (2.40)-(2.42)

and the filter passes over the record repeatedly: the unknowns start from the result of the last
pass, with their covariance enlarged by a weight. Φ is exact here, not I + Δt·∂g/∂X. The noise is an
input, as published; the method does not estimate it.

An unknown initial state stands in X a second time, as a constant like the parameters (a fixed-point
smoother), so that the whole record corrects it and its interval is of the record.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.structures.identification.identify import Outcome, settled, unsettled
from rigwatch.structures.identification.problem import Problem
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError

REMARK = "the noise was given to the filter; its intervals rest on that figure"


def solve(
    problem: Problem,
    *,
    iterations: int = 25,
    noise: FloatArray | float = 0.01,
    spread: float = 0.5,
    weight: float = 100.0,
    drift: float = 1e-6,
) -> Outcome:
    """Pass over the record until four digits are stable.

    Args:
        problem: the identification problem.
        iterations: largest number of passes.
        noise: standard deviation of each output's noise, shape (outputs,); or one number, as a
            share of each output's rms.
        spread: standard deviation of the guess, as a share of it.
        weight: factor on the unknowns' covariance from one pass to the next.
        drift: standard deviation of the system noise per sample, as a share of each state's rms.

    Raises:
        ModelError: every signal is at rest, so that its noise, a share of it, is none.
    """
    run = _Filter(problem, noise, drift)
    if not np.nanmax(run.variance, initial=0.0) > 0:
        name = problem.system.model.name
        raise ModelError(f"{name}: found signals that never change, expected a record of motion")
    remarks = (*run.remarks, REMARK)
    found, covariance = [problem.guess], run.prior(problem.guess, spread)
    for turn in range(iterations):
        unknowns, after = run.through(found[-1], covariance)
        if unknowns is None:
            return Outcome(found[1:] or found, None, False, ("the filter diverged", *remarks))
        found.append(unknowns)
        if turn and settled(found[-2], found[-1]):
            return Outcome(found[1:], after, True, remarks)
        covariance = after * weight
    return Outcome(found[1:], covariance / weight, False, (unsettled(iterations), *remarks))


@dataclass
class _Filter:
    """One pass over the record."""

    problem: Problem
    noise: FloatArray | float
    drift: float

    def __post_init__(self) -> None:
        problem = self.problem
        seen = np.isfinite(problem.observed).any(axis=0)
        size = np.sqrt(np.nanmean(np.where(seen, problem.observed, 0.0) ** 2, axis=0))
        self.variance = (
            self.noise * np.ones_like(size) * (size if np.isscalar(self.noise) else 1)
        ) ** 2
        self.size = np.sqrt(np.mean(problem.shown[problem.first :] ** 2, axis=0))

    @property
    def remarks(self) -> tuple[str, ...]:
        """The outputs that are left out, if there are any."""
        outputs, observed = self.problem.system.model.outputs, self.problem.observed
        seen = np.asarray(np.isfinite(observed).any(axis=0))
        silent = [
            n for n, there, v in zip(outputs, seen, self.variance, strict=True) if there and not v
        ]
        return tuple(f"{name} shows no noise, as it is always 0: left out" for name in silent)

    def prior(self, guess: FloatArray, spread: float) -> FloatArray:
        """Covariance of the unknowns before the first pass."""
        count = len(self.problem.free)
        deviation = spread * np.where(guess == 0, 1.0, np.abs(guess))
        deviation[count:] = self.size[self.problem.loose]
        return np.diag(deviation**2)

    def through(
        self, unknowns: FloatArray, covariance: FloatArray
    ) -> tuple[FloatArray | None, FloatArray]:
        """Unknowns and their covariance after the pass; None if it diverged."""
        problem, sweeper = self.problem, self.problem.sweeper
        parameters, x = problem.split(unknowns)
        m, c, n = len(problem.free), len(unknowns), len(x)
        found, whole = unknowns.copy(), self._joined(covariance, m, n)
        inputs, dt, steps = problem.recording.inputs, problem.recording.dt, np.eye(c + n)
        moving = [*range(m), *range(c, c + n)]
        system_noise = np.concatenate([np.zeros(c), (self.drift * self.size) ** 2])
        for k in range(len(problem.observed)):
            row = problem.first + k
            y, read = sweeper.observe(inputs, dt, row, x, parameters)
            along = np.zeros((len(y), c + n))
            along[:, moving] = read
            change, whole = self._corrected(whole, problem.observed[k] - y, along)
            found += change[:c]
            parameters[problem.free] = found[:m]
            x += change[c:]
            if not np.isfinite(change).all() or not np.isfinite(whole).all():
                return None, covariance
            if k + 1 < len(problem.observed):
                steps[c:, moving] = sweeper.forward(
                    inputs, dt, row, problem.substeps, x, parameters
                )
                whole = steps @ whole @ steps.T
                whole[np.diag_indices(c + n)] += system_noise
        return found, whole[:c, :c]

    def _joined(self, covariance: FloatArray, m: int, n: int) -> FloatArray:
        """Covariance of {a, x(0), x} at the first sample, where an unknown x is its x(0).

        A known initial state has none.
        """
        count = len(covariance)
        copied = np.concatenate([np.eye(count), np.zeros((n, count))])
        copied[count + self.problem.loose, np.arange(m, count)] = 1.0
        return np.asarray(copied @ covariance @ copied.T)

    def _corrected(
        self, whole: FloatArray, innovation: FloatArray, read: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        use = np.isfinite(innovation) & (self.variance > 0)
        h, v = read[use], np.diag(self.variance[use])
        gain = np.linalg.solve(h @ whole @ h.T + v, h @ whole).T
        left = np.eye(len(whole)) - gain @ h
        return gain @ innovation[use], left @ whole @ left.T + gain @ v @ gain.T
