"""A user of pysindy: smoothed derivatives, a library of terms, sparse regression, `simulate`.

The library has polynomials up to the third degree and, as the data come from machines, the sign and
the square of the velocity. The threshold is chosen on the last fifth of the training recording.
"""

import warnings

import numpy as np
import pysindy

from benchmarks.comparing.task import Part, Task
from rigwatch.wire.arrays import FloatArray

THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)
SHARE = 0.8
"""Share of the training recording that is fitted, the rest selects the threshold."""
STUCK = 1e-2
"""Velocity over its rms below which the sign is smoothed."""
LINEAR = {"1", "x", "v", "u"}


def found_by(task: Task) -> tuple[list[FloatArray], str]:
    """Free runs over the held-out recordings, and the terms beyond the linear ones."""
    part = task.train[0]
    scale = _scales(task, part)
    states, drive = _states(task, part, scale)
    cut, t = round(SHARE * len(states)), task.dt / scale[3]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        tried = []
        for threshold in THRESHOLDS:
            model = pysindy.SINDy(
                optimizer=pysindy.STLSQ(threshold=threshold),
                feature_library=_library(),
                differentiation_method=pysindy.SmoothedFiniteDifference(),
            )
            model.fit(states[:cut], t=t, u=drive[:cut], feature_names=["x", "v", "u"])
            tried.append((model.score(states[cut:], t=t, u=drive[cut:]), model))
        _, model = max(tried, key=lambda one: one[0])
        runs = [_run(task, model, each, scale) for each in task.held_out]
    names, row = model.get_feature_names(), model.coefficients()[1]
    more = [n for n, c in zip(names, row, strict=True) if c != 0 and n not in LINEAR]
    return runs, ", ".join(more) or "no term"


def _library() -> pysindy.feature_library.base.BaseFeatureLibrary:
    custom = pysindy.CustomLibrary(
        library_functions=[lambda v: np.tanh(v / STUCK), lambda v: v * np.abs(v)],
        function_names=[lambda v: f"sign({v})", lambda v: f"{v}|{v}|"],
    )
    return pysindy.GeneralizedLibrary(
        [pysindy.PolynomialLibrary(degree=3), custom],
        inputs_per_library=[[0, 1, 2], [1]],
    )


def _scales(task: Task, part: Part) -> FloatArray:
    """Sizes of position, velocity and input, and the unit of time [s]."""
    x, v = np.std(part.y), np.std(_speed(task, part))
    return np.array([x, v, np.std(part.u), x / v])


def _speed(task: Task, part: Part) -> FloatArray:
    time = np.arange(len(part.y)) * task.dt
    smooth = pysindy.SmoothedFiniteDifference()
    return np.asarray(smooth(part.y[:, None], time))[:, 0]


def _states(task: Task, part: Part, scale: FloatArray) -> tuple[FloatArray, FloatArray]:
    states = np.column_stack([part.y / scale[0], _speed(task, part) / scale[1]])
    return states, part.u[:, None] / scale[2]


def _run(task: Task, model: pysindy.SINDy, part: Part, scale: FloatArray) -> FloatArray:
    """A free run; infinite if it diverges."""
    states, drive = _states(task, part, scale)
    time = np.arange(len(states)) * task.dt / scale[3]
    options = {"method": "LSODA", "rtol": 1e-4, "atol": 1e-6}
    try:
        run = model.simulate(states[0], time, u=drive, integrator_kws=options)
    except (ValueError, RuntimeError, FloatingPointError):
        return np.full(len(states), np.inf)
    # With a sampled input pysindy leaves out the last sample; fewer mean that the run diverged.
    missing = len(states) - len(run)
    return np.pad(run[:, 0] * scale[0], (0, missing), "edge" if missing <= 1 else "empty")
