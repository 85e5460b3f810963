"""Whether a further step keeps what the gradient promises.

At a corner of the error the gradient of one side promises a reduction that no step gives: the limit
of a drive, fitted to inputs held at a few levels, ends where it meets one of them, and beyond it
other samples are limited. There a fit has converged although its gradient does not vanish. Along
a smooth valley, however narrow, a short enough step keeps its promise.
"""

import numpy as np

from rigwatch.physics.engine.fit import Fit, Recording, bounds, error_at
from rigwatch.physics.engine.search.convergence import (
    PROMISED,
    UNDETERMINED,
    at_bound,
    promise,
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

    def size(parameters: FloatArray) -> float:
        system = fitted.compiled
        return error_at(system, recording, horizon, parameters, fitted.scale, substeps) ** 2

    here, kept = size(fitted.parameters), 0.0
    for part in FRACTIONS:
        expected = promised * part * (2 - part) * here
        found = here - size(_moved(fitted, part))
        kept = max(kept, found / expected)
    return promised * min(kept, 1.0)


def _moved(fitted: Fit, part: float) -> FloatArray:
    """All parameters after a part of a Gauss-Newton step within bounds."""
    system, parameters = fitted.compiled.system, fitted.parameters.copy()
    moving = [name not in at_bound(fitted) for name in system.free]
    jacobian = fitted.jacobian.reshape(fitted.error.size, fitted.jacobian.shape[-1]) * moving
    size = np.sqrt(np.sum(jacobian**2, axis=0))
    size[size == 0] = 1.0
    step, *_ = np.linalg.lstsq(jacobian / size, -fitted.error.ravel(), rcond=UNDETERMINED)
    names = list(system.parameters)
    free = [names.index(name) for name in system.free]
    parameters[free] = np.clip(parameters[free] + part * step / size, *bounds(system))
    return parameters
