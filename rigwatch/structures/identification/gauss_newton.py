"""Gauss-Newton with sensitivity equations over the whole record (Distefano and Rath; thesis 2.1).

The augmented state u = {x, ẋ, a} starts at c, of which a part is known. About an estimate of c

    du_c/dt = g_u·u_c,   A·Δc = b,   A = ∫ u_cᵀ·Γᵀ·Γ·u_c dt + Λ                     (2.21)-(2.24)

with the model's own trajectory as the nominal one. It takes full steps, as published: from a poor
guess the trajectories diverge from the record and it fails.
"""

import numpy as np

from rigwatch.structures.identification.identify import Outcome, settled, unsettled
from rigwatch.structures.identification.least_squares import require_determined
from rigwatch.structures.identification.least_squares import solve as least_squares
from rigwatch.structures.identification.problem import Problem
from rigwatch.wire.arrays import FloatArray

SMALL = 0.02
"""Share of the signals below which errors count as model error."""
PARTED = "the model's trajectory diverged (NaN or infinite)"
LASTING = 0.4
"""Correlation of consecutive errors above which they are not noise."""


def solve(problem: Problem, *, iterations: int = 25, trust: float = 0.0) -> Outcome:
    """Iterate until four digits are stable.

    Args:
        problem: the identification problem.
        iterations: largest number of iterations.
        trust: weight Λ of the guess, as the number of samples with an error of one standard
            deviation that equals a guess wrong by its own size; 0 for none.

    Raises:
        ModelError: the record does not determine the unknowns.
    """
    found, covariance = [problem.guess], None
    seen = np.isfinite(problem.observed).any(axis=0)
    scale = np.nanstd(np.where(seen, problem.observed, 0.0), axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    name = problem.system.model.name
    for turn in range(iterations):
        outputs, slopes = problem.simulate(found[-1], problem.substeps)
        if not np.isfinite(slopes).all():
            return Outcome(found[1:] or found, covariance, False, (PARTED,))
        errors, slopes, weight = _with_prior(
            problem, problem.observed - outputs, slopes, found[-1], trust, scale
        )
        step = least_squares(errors, slopes, weight, scale)
        if not turn:
            require_determined(problem.names, step.blind, name)
        found.append(found[-1] + step.change)
        covariance = step.covariance
        if turn and settled(found[-2], found[-1]):
            require_determined(problem.names, step.blind, name)
            remarks = _doubts(problem.observed - outputs, scale)
            return Outcome(found[1:], covariance, not remarks, remarks)
    return Outcome(found[1:] or found, covariance, False, (unsettled(iterations),))


def _doubts(errors: FloatArray, scale: FloatArray) -> tuple[str, ...]:
    """Why the solution is a wrong minimum (its residual is not noise), empty if it is not.

    Errors of consecutive samples are independent if only noise is left. If the model's trajectory
    differs from the record's they are correlated, regardless of their size.
    """
    share = float(np.sqrt(np.nanmean((errors / scale) ** 2)))
    along = np.nan_to_num(errors / scale)
    lasting = float((along[1:] * along[:-1]).sum() / max(float((along**2).sum()), 1e-300))
    if share < SMALL or lasting < LASTING:
        return ()
    return (
        f"a wrong minimum: it settled where errors are {100 * share:.2g} % of the signals, and go"
        " on from sample to sample as noise does not",
    )


def _with_prior(  # noqa: PLR0917 -- a step's rows with what belongs to them
    problem: Problem,
    errors: FloatArray,
    slopes: FloatArray,
    now: FloatArray,
    trust: float,
    scale: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The rows, with those of (u(0) − u0, Λ·(u(0) − u0)) appended."""
    if trust <= 0:
        return errors, slopes, problem.weight
    count, width = len(now), errors.shape[1]
    size = np.where(problem.guess == 0, 1.0, np.abs(problem.guess))
    more, steep = np.full((count, width), np.nan), np.zeros((count, width, count))
    more[:, 0] = (problem.guess - now) / size * np.sqrt(trust) * scale[0]
    steep[:, 0] = np.diag(np.sqrt(trust) * scale[0] / size)
    return (
        np.concatenate([errors, more]),
        np.concatenate([slopes, steep]),
        np.concatenate([problem.weight, np.ones(count)]),
    )
