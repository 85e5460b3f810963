"""Windowed least squares against statsmodels, filterpy, padasip and river: time an update, and
error after a spike.
"""

import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from monitor.estimation.window import new_window, windowed_least_squares
from tools.benchmark_table import Row

Floats = NDArray[np.float64]
WINDOW = 300
SPIKE = 1.0e9
RIVALS = ("statsmodels", "filterpy", "padasip", "river")


def data(n: int) -> tuple[Floats, Floats]:
    """Regressors like friction's, shape (n, 2), and y, shape (n,), with one spike two windows
    before the end.
    """
    random = np.random.default_rng(1)
    v = np.sin(0.19 * np.arange(n)) + 0.1 * random.standard_normal(n)
    g = np.column_stack([np.sign(v), v])
    y = g @ np.array([1.0, 0.2]) + 0.01 * random.standard_normal(n)
    y[n - 2 * WINDOW] = SPIKE
    return g, y


def ours(g: Floats, y: Floats) -> Floats:
    """θ after each sample, shape (n, 2)."""
    theta = np.empty((y.size, 2))
    g1, g2 = np.ascontiguousarray(g[:, 0]), np.ascontiguousarray(g[:, 1])
    windowed_least_squares(new_window(WINDOW), g1, g2, y, theta)
    return theta


def statsmodels(g: Floats, y: Floats) -> Floats:
    """RollingOLS: the same window."""
    rolling = import_module("statsmodels.regression.rolling").RollingOLS
    return np.asarray(rolling(y, g, window=WINDOW).fit(params_only=True).params)


def filterpy(g: Floats, y: Floats) -> Floats:
    """A Kalman filter of constant parameters: grows old instead of forgetting."""
    kalman = import_module("filterpy.kalman").KalmanFilter(dim_x=2, dim_z=1)
    kalman.P *= 1e6
    theta = np.empty((y.size, 2))
    for k in range(y.size):
        kalman.predict()
        kalman.update(y[k], H=g[k : k + 1])
        theta[k] = kalman.x[:, 0]
    return theta


def padasip(g: Floats, y: Floats) -> Floats:
    """Recursive least squares that forgets exponentially, with a memory of one window."""
    rls = import_module("padasip").filters.FilterRLS(n=2, mu=1.0 - 1.0 / WINDOW)
    return np.asarray(rls.run(y, g)[2])


def river(g: Floats, y: Floats) -> Floats:
    """Bayesian linear regression that forgets, as river offers it for streams."""
    model: Any = import_module("river.linear_model").BayesianLinearRegression(
        smoothing=1.0 - 1.0 / WINDOW
    )
    theta = np.empty((y.size, 2))
    for k in range(y.size):
        x = {"g1": float(g[k, 0]), "g2": float(g[k, 1])}
        model.learn_one(x, float(y[k]))
        theta[k] = (
            model.predict_one({"g1": 1.0, "g2": 0.0}),
            model.predict_one({"g1": 0.0, "g2": 1.0}),
        )
    return theta


def run(quick: bool) -> list[Row]:
    """One row for exactness, one a rival for speed."""
    length = 100_000 if quick else 1_000_000
    g, y = data(length)
    ours(g[:1000], y[:1000])
    started = time.perf_counter()
    theta = ours(g, y)
    each = (time.perf_counter() - started) / length
    rows = [_exactness(theta, g, y)]
    return rows + [_rival(name, each, 2000 if quick else 20_000) for name in RIVALS]


def _fresh(g: Floats, y: Floats, end: int) -> Floats:
    part = slice(end + 1 - WINDOW, end + 1)
    return np.asarray(np.linalg.lstsq(g[part], y[part], rcond=None)[0])


def _exactness(theta: Floats, g: Floats, y: Floats) -> Row:
    ends = [y.size - 1, y.size - 2, y.size - WINDOW, y.size // 2]
    worst = max(float(np.max(np.abs(theta[end] - _fresh(g, y, end)))) for end in ends)
    return Row(
        f"windowed least squares after {y.size:.0e} updates",
        f"{worst:.1e} from a fresh solve",
        "1e-9",
        "",
        f"a spike of {SPIKE:g} went through the window {2 * WINDOW} samples before the end",
        passed=worst < 1e-9,
    )


def _rival(name: str, ours_each: float, length: int) -> Row:
    g, y = data(length)
    rival: Callable[[Floats, Floats], Floats] = globals()[name]
    try:
        started = time.perf_counter()
        theta = rival(g, y)
        each = (time.perf_counter() - started) / length
    except ImportError:
        what, note = f"windowed least squares against {name}", "install the dependency group bench"
        return Row(what, "not installed", "faster", "", note, passed=None)
    error = float(np.max(np.abs(theta[-1] - _fresh(g, y, y.size - 1))))
    return Row(
        f"windowed least squares against {name}",
        f"{ours_each * 1e9:.0f} ns, {name} {each * 1e9:.0f} ns an update",
        "faster",
        "",
        f"{name} ends {error:.1e} from a fresh solve of the window, the spike having left it",
        passed=ours_each < each,
    )
