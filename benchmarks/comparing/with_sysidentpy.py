"""A user of SysIdentPy: a polynomial NARX model, terms by forward regression, `predict`.

The recordings are decimated, as the library's case studies do. The number of terms is chosen by
Akaike's criterion; lags and degree by a free run over the last fifth of the training recording.
Names of terms are lagged samples, not physics.
"""

import warnings

import numpy as np
from scipy.signal import decimate
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

from benchmarks.comparing.task import Part, Task
from rigwatch.wire.arrays import FloatArray

TRIED = ((2, 1), (2, 3), (4, 2), (4, 3))
"""Lags and degrees."""
MOST_TERMS = 15
SHARE = 0.8
"""Share of the training recording that is fitted, the rest selects lags and degree."""


def found_by(task: Task) -> tuple[list[FloatArray], str]:
    """Free runs over the held-out recordings, and how many terms the model has."""
    scale = float(np.std(task.train[0].y)), float(np.std(task.train[0].u))
    y, u = _thinned(task, task.train[0], scale)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cut = round(SHARE * len(y))
        models = [_fitted(y[:cut], u[:cut], *each) for each in TRIED]
        model = min(models, key=lambda one: _left(one, y[cut:], u[cut:]))
        runs = []
        for part in task.held_out:
            measured, driving = _thinned(task, part, scale)
            run = model.predict(X=driving, y=measured[: model.max_lag])
            runs.append(np.asarray(run[:, 0] * scale[0], np.float64))
    return runs, f"{len(model.final_model)} terms of lagged samples"


def _fitted(y: FloatArray, u: FloatArray, lags: int, degree: int) -> FROLS:
    model = FROLS(
        xlag=lags, ylag=lags, basis_function=Polynomial(degree=degree), estimator=LeastSquares(),
        order_selection=True, n_info_values=MOST_TERMS, info_criteria="aic",
    )  # fmt: skip
    return model.fit(X=u, y=y)


def _left(model: FROLS, y: FloatArray, u: FloatArray) -> float:
    """Error of a free run; infinite if it diverges."""
    error = float(np.sqrt(np.mean((model.predict(X=u, y=y[: model.max_lag]) - y) ** 2)))
    return error if np.isfinite(error) else float("inf")


def _thinned(task: Task, part: Part, scale: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Output and input, decimated and scaled, each of shape (n, 1)."""
    columns = (part.y / scale[0], part.u / scale[1])
    if task.thin > 1:
        columns = tuple(decimate(each, task.thin, zero_phase=True) for each in columns)
    return columns[0][:, None], columns[1][:, None]
