"""Two Kalman filters side by side: one detects a bias of the position sensor, one estimates it.

Two filters run side by side on the same model (Nowakowski, Boutayeb and Darouach 1993, thesis
2.54-2.61):

* the plain one assumes a correct position sensor. Its innovations are white and of known size while
  that is right; a sliding chi-square test of them detects the fault (`innovation_test.py`);
* the generalised one takes the sensor's bias η as an unknown input of the measurement,
  y = H·x + G·η, and so estimates the fault-free states and the bias.

On the rig the model is the transfer function with W = q·B·Bᵀ + s·I: errors of a linear model of a
nonlinear plant act partly like an unknown drive of variance q [input unit²]; s [output unit²] keeps
W regular. The measurements are the position and, if available, the acceleration one sample ago,
which distinguishes a moved sensor from a moved mass. All signals pass one high-pass
(`high_pass.py`), as neither an integrating plant nor a piezo accelerometer shows a constant offset.
So a bias shows when it appears and then decays.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from monitor.detectors.high_pass import high_pass_sample
from monitor.detectors.innovation_test import NisWindow, clear_nis, new_nis_window, push_nis
from monitor.detectors.kalman import augmented_matrices, generalised_update, kalman_update
from monitor.detectors.small_matrices import (
    product,
    product_transposed,
    put_identity,
    put_sum,
    times,
)
from monitor.detectors.state_space import state_space
from monitor.signals import DEAD, HELD, NEW_BOOT, RESTART
from rigwatch.physics.transfer import TransferFunction
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Variances of the filters and limit of the test.

    Attributes:
        input: q, variance of the model's error as a drive [input unit²].
        state: s, variance that keeps W regular [output unit²].
        position: variance of the position reading [m²].
        acceleration: variance of the acceleration reading [m²/s⁴].
        window: samples whose innovations are tested together [1].
        limit: of their sum [1].
        settle: samples after a start that are not judged [1].
        corner: of the high-pass of all signals [Hz]; 0 for none.
    """

    input: float
    state: float
    position: float
    acceleration: float
    window: int
    limit: float
    settle: int
    corner: float = 0.0


class FilterModel(NamedTuple):
    """Constant matrices of both filters, as in `kalman.py`."""

    a: FloatArray
    b: FloatArray
    w: FloatArray
    h: FloatArray
    v: FloatArray
    v_inverse: FloatArray
    e: FloatArray
    c: FloatArray


class FilterState(NamedTuple):
    """Carried state.

    Attributes:
        plain, plain_p: state and covariance of the plain filter.
        general, general_p: the same of the generalised one.
        augmented: x̄ of the generalised one, its last entry is the bias.
        last: input and acceleration of the sample before, high-passed, shape (2,).
        raw, high: signals as they came and high-passed, shape (2 or 3,).
        window: normalised innovations.
        counts: samples since the start; resets so far.
    """

    plain: FloatArray
    plain_p: FloatArray
    general: FloatArray
    general_p: FloatArray
    augmented: FloatArray
    last: FloatArray
    raw: FloatArray
    high: FloatArray
    window: NisWindow
    counts: NDArray[np.int64]


def filter_model(
    function: TransferFunction, noise: NoiseModel, sample_rate: float, *, with_acceleration: bool
) -> FilterModel:
    """Matrices for position, and acceleration where `with_acceleration`.

    Raises:
        ModelError: the model has no delay, or the bias would not show.
    """
    model = state_space(function)
    rows = [model.position_row()]
    variances = [noise.position]
    if with_acceleration:
        rows.append(model.acceleration_row(sample_rate))
        variances.append(noise.acceleration)
    h, v = np.array(rows), np.diag(variances)
    w = noise.input * np.outer(model.b, model.b) + noise.state * np.eye(model.b.size)
    bias = np.eye(len(rows), 1)
    e, c = augmented_matrices(h, np.zeros((model.b.size, 0)), bias)
    v_inverse = np.diag(1.0 / np.array(variances))
    return FilterModel(model.a, model.b, w, h, v, v_inverse, e, c)


def new_filter_state(model: FilterModel, window: int) -> FilterState:
    """The initial filters."""
    n = model.b.size
    return FilterState(
        np.zeros(n),
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros((n, n)),
        np.zeros(model.e.shape[1]),
        np.zeros(2),
        np.zeros(1 + model.h.shape[0]),
        np.zeros(1 + model.h.shape[0]),
        new_nis_window(window),
        np.zeros(2, np.int64),
    )


@part()
def _start(model: FilterModel, state: FilterState, beta: float, signals: FloatArray) -> None:
    """Start at the measured position, with unknown motion."""
    for i in range(signals.size):
        state.raw[i] = signals[i]
        state.high[i] = signals[i] if beta == 1.0 else 0.0
    for i in range(model.b.size):
        state.plain[i] = state.general[i] = state.high[1]
    spread = 1e4 * (model.v[0, 0] + model.w[0, 0])
    put_identity(state.plain_p, spread)
    put_identity(state.general_p, spread)
    clear_nis(state.window)
    state.last[0], state.last[1] = state.high[0], state.high[state.high.size - 1]
    state.counts[0] = 0


@part(allocates=True)
def _predict(model: FilterModel, x: FloatArray, p: FloatArray, u: float) -> None:
    ahead = times(model.a, x)
    for i in range(x.size):
        x[i] = ahead[i] + model.b[i] * u
    put_sum(p, product_transposed(product(model.a, p), model.a), model.w)


@part()
def _step(model: FilterModel, state: FilterState, y: FloatArray) -> float:
    """Update both filters; normalised innovation squared, NaN if a filter failed."""
    nis = kalman_update(state.plain, state.plain_p, model.h, model.v, y)
    ok = generalised_update(
        state.general, state.general_p, model.e, model.c, model.v_inverse, y, state.augmented
    )
    for i in range(state.plain.size):
        ok = ok and np.isfinite(state.plain[i]) and np.isfinite(state.general[i])
    return nis if ok else np.nan


@part()
def _measure(state: FilterState, beta: float, signals: FloatArray, y: FloatArray) -> None:
    """High-pass the signals; `y` becomes the position now and the acceleration one sample ago."""
    high_pass_sample(beta, state.raw, state.high, signals)
    y[0] = state.high[1]
    if y.size > 1:
        y[1] = state.last[1]
        state.last[1] = state.high[2]


@kernel(allocates=True)
def unknown_input_block(
    model: FilterModel,
    state: FilterState,
    traits: tuple[int, float],
    signals: FloatArray,
    code: NDArray[np.int64],
) -> tuple[FloatArray, FloatArray]:
    """Bias [output unit] and sum of normalised innovations [1]; NaN if not judged.

    Args:
        model: constant matrices.
        state: carried on.
        traits: samples after a start that are not judged, high-pass coefficient.
        signals: input, position and, with two measurements, acceleration; shape (n, 2 or 3).
        code: of admission, shape (n,).
    """
    settle, beta = traits
    bias, total = np.full(code.size, np.nan), np.full(code.size, np.nan)
    y = np.empty(model.h.shape[0])
    for k in range(code.size):
        if code[k] == DEAD:
            continue
        if code[k] == RESTART or code[k] == NEW_BOOT:
            _start(model, state, beta, signals[k])
            continue
        _predict(model, state.plain, state.plain_p, state.last[0])
        _predict(model, state.general, state.general_p, state.last[0])
        _measure(state, beta, signals[k], y)
        state.last[0] = state.high[0]
        state.counts[0] += 1
        if code[k] == HELD:
            continue
        nis = _step(model, state, y)
        if np.isnan(nis):
            _start(model, state, beta, signals[k])
            state.counts[1] += 1
        elif state.counts[0] > settle:
            total[k] = push_nis(state.window, nis)
            bias[k] = state.augmented[model.b.size]
    return bias, total
