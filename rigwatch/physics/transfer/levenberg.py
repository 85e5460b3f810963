"""Damped Gauss-Newton steps for fits of transfer functions (Levenberg 1944, Marquardt 1963).

Each column of the gradient is scaled to unit length, so one damping suits all coefficients. Errors
and gradients may be complex: real and imaginary parts count as separate errors.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigwatch.wire.arrays import FloatArray

START, LEAST, MOST = 1e-3, 1e-12, 1e8


@dataclass(frozen=True)
class Descent:
    """Settings of a search.

    Attributes:
        steps: most trials.
        more, less: factor and divisor of the damping after a failed or a successful step.
        worth: relative gain below which the search ends.
    """

    steps: int
    more: float
    less: float
    worth: float


def least_squares_coefficients(rows: Any, target: Any) -> FloatArray:
    """Real coefficients that bring `rows` closest to `target`; both may be complex."""
    rows, target = _stacked(rows), _stacked(target)
    scale = _lengths(rows)
    return np.asarray(np.linalg.lstsq(rows / scale, target, rcond=None)[0] / scale)


def descend(
    theta: FloatArray,
    how: Descent,
    *,
    errors: Callable[[FloatArray], Any],
    gradient: Callable[[FloatArray], Any],
    cost: Callable[[FloatArray], float],
    admissible: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """The coefficients at which the search ends.

    Args:
        theta: initial coefficients, shape (k,).
        how: settings.
        errors: measured minus modelled, shape (n,).
        gradient: of the model by the coefficients, shape (n, k).
        cost: the cost to minimise.
        admissible: maps coefficients to the nearest allowed ones, e.g. stable ones.
    """
    size, damping = cost(theta), START
    for _ in range(how.steps):
        trial = admissible(theta + _damped_step(gradient(theta), errors(theta), damping))
        gained = size - (trial_size := cost(trial))
        if gained <= 0.0:
            damping *= how.more
            if damping > MOST:
                break
            continue
        theta, size, damping = trial, trial_size, max(damping / how.less, LEAST)
        if gained < how.worth * size:
            break
    return theta


def _damped_step(gradient: Any, error: Any, damping: float) -> FloatArray:
    rows = _stacked(gradient)
    scale = _lengths(rows)
    padded = np.vstack([rows / scale, np.sqrt(damping) * np.eye(scale.size)])
    target = np.concatenate([_stacked(error), np.zeros(scale.size)])
    return np.asarray(np.linalg.lstsq(padded, target, rcond=None)[0] / scale)


def _stacked(values: Any) -> FloatArray:
    """Real and imaginary parts stacked; real values unchanged."""
    return np.concatenate([values.real, values.imag]) if np.iscomplexobj(values) else values


def _lengths(rows: FloatArray) -> FloatArray:
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0.0] = 1.0
    return np.asarray(scale)
