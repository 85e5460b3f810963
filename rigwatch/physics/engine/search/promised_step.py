"""Whether a further step keeps what the gradient promises.

At a corner of the error the gradient of one side promises a reduction that no step gives: the limit
of a drive, fitted to inputs held at a few levels, ends where it meets one of them, and beyond it
other samples are limited. There a fit has converged although its gradient does not vanish. Along
a smooth valley, however narrow, a short enough step keeps its promise.
"""

import math

import numpy as np

from rigwatch.physics.engine.compile import rate_limit
from rigwatch.physics.engine.fit import Fit, Recording, bounds, error_at
from rigwatch.physics.engine.search.continued_fit import continued_error_at
from rigwatch.physics.engine.search.convergence import (
    PROMISED,
    UNDETERMINED,
    promise,
    slopes,
)
from rigwatch.wire.arrays import FloatArray

FRACTIONS = (1.0, 1 / 4, 1 / 16, 1 / 64)
"""Lengths of the steps that are tried, relative to the Gauss-Newton step."""


def kept_promise(fitted: Fit, recording: Recording, horizon: int, substeps: int) -> float:
    """Relative reduction of the squared error that a further step promises, as far as it is kept.

    Args:
        fitted: the fit.
        recording, horizon, substeps: what it was fitted to, as in `fit`.
    """
    promised = promise(fitted)
    if promised <= PROMISED:
        return promised

    system = fitted.compiled
    limit = rate_limit(system, fitted.parameters, recording.dt)

    def size(parameters: FloatArray) -> float:
        # A fit goes no further than the recording resolves.
        if system.fastest(parameters) > limit:
            return math.inf
        if fitted.continued:
            return continued_error_at(fitted, recording, horizon, substeps, parameters) ** 2
        return error_at(system, recording, horizon, parameters, fitted.scale, substeps) ** 2

    here, step = size(fitted.parameters), _gauss_newton_step(fitted)
    kept = 0.0
    for part in FRACTIONS:
        expected = promised * part * (2 - part) * here
        found = here - size(_within_bounds(fitted, part * step))
        kept = max(kept, found / expected)
    return promised * min(kept, 1.0)


def _gauss_newton_step(fitted: Fit) -> FloatArray:
    """The step of each free parameter, 0 for those on a bound."""
    columns, sizes = slopes(fitted)
    seen = sizes > 0
    step = np.zeros(sizes.size)
    found, *_ = np.linalg.lstsq(columns[:, seen], -fitted.error.ravel(), rcond=UNDETERMINED)
    step[seen] = found / sizes[seen]
    return step


def _within_bounds(fitted: Fit, step: FloatArray) -> FloatArray:
    """All parameters after a step of the free ones that ends at their bounds."""
    system, parameters = fitted.compiled.system, fitted.parameters.copy()
    names = list(system.parameters)
    free = [names.index(name) for name in system.free]
    parameters[free] = np.clip(parameters[free] + step, *bounds(system))
    return parameters
