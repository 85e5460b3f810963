"""A user of SciPy: the equation in Python, `solve_ivp` for a run, `least_squares` for parameters.

A long free run has local minima, so the user fits a tenth of the recording first, then a third,
then all of it.
"""

import types
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from benchmarks.comparing.task import Part, Task
from rigwatch.wire.arrays import FloatArray


def predictions(task: Task, terms: tuple[Any, ...]) -> list[FloatArray]:
    """Free runs over the held-out recordings.

    Args:
        task: the data.
        terms: (initial value, function) of further terms that the user writes.
    """
    fitted = np.array([*task.start[: 3 if task.start[2] else 2], *(start for start, _ in terms)])

    def residuals(scaled: FloatArray, share: float) -> FloatArray:
        parts = [_beginning(part, share) for part in task.train]
        runs = [_run(task, part, scaled * fitted, terms) - part.y for part in parts]
        return np.concatenate(runs) / np.std(task.train[0].y)

    scaled = np.ones(len(fitted))
    for share in (0.1, 0.33, 1.0):
        scaled = least_squares(
            residuals, scaled, x_scale="jac", diff_step=1e-4, max_nfev=30, args=(share,)
        ).x
    return [_run(task, part, scaled * fitted, terms) for part in task.held_out]


def _beginning(part: Part, share: float) -> Part:
    samples = round(share * len(part.y))
    return Part(part.u[:samples], part.y[:samples])


def _run(task: Task, part: Part, theta: FloatArray, terms: tuple[Any, ...]) -> FloatArray:
    """One free run from the measured position and its slope."""
    time = np.arange(len(part.y)) * task.dt
    g, c = theta[:2]
    k, own = (theta[2], theta[3:]) if task.start[2] else (0.0, theta[2:])
    forces = types.SimpleNamespace(tanh=np.tanh)

    def rates(t: float, state: FloatArray) -> list[float]:
        x, v = state
        more = sum(a * f(x, v, forces) for a, (_, f) in zip(own, terms, strict=True))
        return [v, g * np.interp(t, time, part.u) - c * v - k * x + more]

    begin = [part.y[0], float(np.polyfit(time[:5], part.y[:5], 1)[0])]
    run = solve_ivp(
        rates, (0.0, time[-1]), begin, method="LSODA", t_eval=time, max_step=2 * task.dt,
        rtol=1e-6, atol=1e-8,
    )  # fmt: skip
    return np.asarray(run.y[0] if run.success else np.full(len(time), np.inf))
