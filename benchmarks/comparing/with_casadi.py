"""A user of CasADi: Runge-Kutta steps mapped over the samples, multiple shooting, IPOPT.

Follows the library's example of system identification: single-shooting residuals would diverge for
wrong parameters, so the states at all samples are unknowns and the gaps between them constraints,
with the Gauss-Newton Hessian.
"""

from typing import Any

import casadi
import numpy as np

from benchmarks.comparing.task import Part, Task
from rigwatch.wire.arrays import FloatArray

STEPS = 4
"""Runge-Kutta steps between two samples."""


def predictions(task: Task, terms: tuple[Any, ...]) -> list[FloatArray]:
    """Free runs over the held-out recordings; arguments as for SciPy."""
    size = np.array([*task.start[: 3 if task.start[2] else 2], *(start for start, _ in terms)])
    sample = _sample(task, terms, size)
    theta = np.array(_fitted(task, sample, len(size)))
    return [_run(task, sample, part, theta) for part in task.held_out]


def _sample(task: Task, terms: tuple[Any, ...], size: FloatArray) -> Any:
    """The state after one sample, as a function of state, both inputs and scaled parameters."""
    state, scaled = casadi.MX.sym("state", 2), casadi.MX.sym("scaled", len(size))
    inputs = casadi.MX.sym("inputs", 2)
    theta, fitted_k = scaled * size, bool(task.start[2])

    def rates(at: Any, share: float) -> Any:
        x, v = at[0], at[1]
        u = inputs[0] + share * (inputs[1] - inputs[0])
        own = casadi.vertsplit(theta[3 if fitted_k else 2 :]) if terms else []
        more = sum(a * f(x, v, casadi) for a, (_, f) in zip(own, terms, strict=True))
        k = theta[2] if fitted_k else 0.0
        return casadi.vertcat(v, theta[0] * u - theta[1] * v - k * x + more)

    at, h = state, task.dt / STEPS
    for step in range(STEPS):
        share = step / STEPS
        k1 = rates(at, share)
        k2 = rates(at + h / 2 * k1, share + 0.5 / STEPS)
        k3 = rates(at + h / 2 * k2, share + 0.5 / STEPS)
        k4 = rates(at + h * k3, share + 1 / STEPS)
        at = at + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return casadi.Function("sample", [state, inputs, scaled], [at]).expand()


def _fitted(task: Task, sample: Any, count: int) -> Any:
    """Scaled parameters by multiple shooting with a Gauss-Newton Hessian."""
    scaled = casadi.MX.sym("scaled", count)
    unknowns, guess, gaps, errors = [scaled], [np.ones(count)], [], []
    for index, part in enumerate(task.train):
        n = len(part.y)
        path = casadi.MX.sym(f"path{index}", 2, n)
        speed = np.gradient(part.y, task.dt)
        size = casadi.DM([float(np.std(part.y)), float(np.std(speed))])
        whole = path * casadi.repmat(size, 1, n)
        moved = sample.map(n - 1)(whole[:, :-1], _inputs(part), casadi.repmat(scaled, 1, n - 1))
        gaps.append(casadi.vec((moved - whole[:, 1:]) / casadi.repmat(size, 1, n - 1)))
        errors.append((whole[0, :].T - part.y) / np.std(part.y))
        unknowns.append(casadi.vec(path))
        guess.append(np.stack([part.y, speed]).T.ravel() / np.tile(np.array(size)[:, 0], n))
    v, e, g = casadi.vertcat(*unknowns), casadi.vertcat(*errors), casadi.vertcat(*gaps)
    j = casadi.jacobian(e, v)
    hessian = casadi.triu(casadi.mtimes(j.T, j))
    weight, others = casadi.MX.sym("weight"), casadi.MX.sym("others", g.numel())
    hess = casadi.Function(
        "gauss_newton", [v, casadi.MX(0, 1), weight, others], [weight * hessian],
        ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"],
    )  # fmt: skip
    options: dict[str, Any] = {
        "ipopt.print_level": 0,
        "print_time": 0,
        "ipopt.sb": "yes",
        "ipopt.max_iter": 100,
    }
    problem = {"x": v, "f": 0.5 * casadi.dot(e, e), "g": g}
    solver = casadi.nlpsol("solver", "ipopt", problem, {"hess_lag": hess, **options})
    return solver(x0=np.concatenate(guess), lbg=0, ubg=0)["x"][:count]


def _inputs(part: Part) -> FloatArray:
    return np.stack([part.u[:-1], part.u[1:]])


def _run(task: Task, sample: Any, part: Part, theta: FloatArray) -> FloatArray:
    slope = np.polyfit(np.arange(5) * task.dt, part.y[:5], 1)[0]
    n = len(part.y) - 1
    path = sample.mapaccum("run", n)([part.y[0], slope], _inputs(part), np.tile(theta, (1, n)))
    return np.append(part.y[0], np.array(path)[0])
