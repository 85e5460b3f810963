"""Profile likelihood: asymmetric intervals, for parameters that enter the model nonlinearly.

A parameter is fixed away from its optimum, the others are refitted, and the interval ends when the
squared error has risen by more than chance allows,

    Δ(Σ r²) = t²(97.5 %) · s² · swelling

(D. Bates, D. Watts, Nonlinear Regression Analysis, 1988). The swelling is the ratio of the
jackknife's variance (`intervals.py`) to the textbook's, so residuals may be autocorrelated, and
Student's t has the degrees of freedom of that variance.
"""

from dataclasses import dataclass, replace

import numpy as np
from msgspec.structs import replace as changed
from scipy.stats import t as student

from rigwatch.physics.engine.compile import CompiledSystem
from rigwatch.physics.engine.fit import Fit, Recording, fit
from rigwatch.physics.engine.search import fit_continued
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.intervals import CONFIDENCE, Value, covariance, values

STEPS = 6
"""Largest number of fits to find one end of an interval."""
CLOSE = 0.02
"""Tolerance of an end, as a share of the allowed rise."""


@dataclass(frozen=True)
class _Search:
    """Inputs of the search for one end."""

    fitted: Fit
    recording: Recording
    horizon: int
    substeps: int
    allowed: float
    best: float


def profile(fitted: Fitted, recording: Recording) -> dict[str, Value]:
    """Every parameter with its interval from the profile.

    Args:
        fitted: the fitted model.
        recording: the recording it was fitted to.
    """
    found, train = values(fitted.train), fitted.train
    robust, degrees = covariance(train)
    for index, name in enumerate(train.compiled.system.free):
        if found[name].note:
            continue
        width = float(np.sqrt(robust[index, index]))
        swelling = robust[index, index] / max(train.covariance[index, index], 1e-300)
        best = float(np.sum(train.error**2))
        deviations = float(student.ppf(0.5 + CONFIDENCE / 2, degrees[index]))
        allowed = deviations**2 * best / train.freedom * swelling
        search = _Search(train, recording, fitted.horizon, fitted.substeps, allowed, best)
        ends = [_end(search, name, sign * deviations * width) for sign in (-1, 1)]
        found[name] = replace(found[name], interval=(ends[0], ends[1]))
    return found


def _end(search: _Search, name: str, step: float) -> float:
    """Value at which the error has risen by the allowed amount, or the parameter's bound."""
    value = search.fitted.values()[name]
    parameter = search.fitted.compiled.system.parameters[name]
    for _ in range(STEPS):
        at = float(np.clip(value + step, parameter.low, parameter.high))
        rise = max(_error(search, name, at) - search.best, 1e-12 * search.allowed)
        if at != value + step and rise < search.allowed:
            return at
        if abs(rise / search.allowed - 1) < CLOSE:
            return at
        step *= float(np.clip(np.sqrt(search.allowed / rise), 0.3, 3.0))
    return float(np.clip(value + step, parameter.low, parameter.high))


def _error(search: _Search, name: str, at: float) -> float:
    """Sum of squares with one parameter fixed and the others refitted."""
    fitted = search.fitted
    system = fitted.compiled.system
    slack = 1e-9 * max(abs(at), 1e-12)
    # Bounds that enclose only the value fix it without compiling another kernel.
    held = changed(system.parameters[name], low=at - slack, high=at + slack)
    parameters = {**system.parameters, name: held}
    compiled = CompiledSystem(replace(system, parameters=parameters), fitted.compiled.kernel)
    start = fitted.parameters.copy()
    start[list(parameters).index(name)] = at
    again = (fit_continued if fitted.continued else fit)(
        compiled, search.recording, search.horizon, start=start, scale=fitted.scale,
        substeps=search.substeps,
    )  # fmt: skip
    return float(np.sum(again.error**2))
