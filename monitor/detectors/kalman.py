"""One step of the Kalman filters: the extended one, and the generalised one for unknown inputs.

    x(k+1) = f(x(k), u(k)) + F·ξ(k) + w(k)        y(k) = H·x(k) + G·η(k) + v(k)    (thesis
    2.54)-(2.55)

    x   state, shape (n,)            ξ   unknown input of the state, F of shape (n, q)
    u   known input                  η   unknown input of the measurement, G of shape (m, p)
    y   measurement, shape (m,)      Φ   Jacobian of f, shape (n, n)
    w   state noise, covariance W    v   measurement noise, covariance V

The generalised filter (Nowakowski, Boutayeb and Darouach 1993) has no model of ξ and η: they join
the state, x̄ = (x, η, ξ of the step before), and with E = [I 0 -F], C = [H G 0] one least-squares
step gives them all:

    P(k+1) = [ Eᵀ·(W + Φ·P·Φᵀ)⁻¹·E + Cᵀ·V⁻¹·C ]⁻¹                                    (thesis 2.61)
    x̄(k+1) = P(k+1)·[ Eᵀ·(W + Φ·P·Φᵀ)⁻¹·f(x(k), u(k)) + Cᵀ·V⁻¹·y(k+1) ]             (thesis 2.60)

It exists where [E; C] has full column rank: every unknown shows in something that is measured.

The steps take a prediction and its covariance, so that they serve linear and nonlinear models.
"""

import numpy as np

from monitor.detectors.small_matrices import (
    inverse,
    product,
    product_transposed,
    put_sum,
    times,
    transposed_product,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.kernel import kernel


@kernel(allocates=True)
def kalman_update(
    x: FloatArray, p: FloatArray, h: FloatArray, v: FloatArray, y: FloatArray
) -> float:
    """Update the predicted `x` and `p` with a measurement, in place (thesis 2.40-2.42).

    Returns the normalised innovation squared νᵀ·S⁻¹·ν, ν = y - H·x, S = H·P·Hᵀ + V: chi-square with
    m degrees of freedom if model and noise are right; NaN if S is singular, and nothing changes.
    """
    innovation = times(h, x)
    for i in range(y.size):
        innovation[i] = y[i] - innovation[i]
    ph = product_transposed(p, h)
    s = product(h, ph)
    put_sum(s, s, v)
    s_inverse = np.empty_like(s)
    if not inverse(s, s_inverse):
        return np.nan
    gain = product(ph, s_inverse)
    keep = product(gain, h)
    for i in range(x.size):
        for j in range(x.size):
            keep[i, j] = (1.0 if i == j else 0.0) - keep[i, j]
    noise = product_transposed(product(gain, v), gain)
    put_sum(p, product_transposed(product(keep, p), keep), noise)
    change = times(gain, innovation)
    for i in range(x.size):
        x[i] += change[i]
    weighted = times(s_inverse, innovation)
    total = 0.0
    for i in range(innovation.size):
        total += innovation[i] * weighted[i]
    return total


@kernel(allocates=True)
def generalised_update(  # noqa: PLR0917 -- a compiled kernel takes no keywords
    x: FloatArray,
    p: FloatArray,
    e: FloatArray,
    c: FloatArray,
    v_inverse: FloatArray,
    y: FloatArray,
    augmented: FloatArray,
) -> bool:
    """Update the predicted `x` and `p` with a measurement, in place (thesis 2.60-2.61).

    Args:
        x: prediction f(x, u), shape (n,); becomes the new state.
        p: its covariance W + Φ·P·Φᵀ, shape (n, n); becomes the state's part of the new one.
        e: E, shape (n, n + p + q).
        c: C, shape (m, n + p + q).
        v_inverse: V⁻¹, shape (m, m).
        y: measurement, shape (m,).
        augmented: receives x̄, shape (n + p + q,).

    Returns whether the step was possible; if not nothing is changed.
    """
    n = x.size
    p_inverse = np.empty_like(p)
    if not inverse(p, p_inverse):
        return False
    prior, measured = transposed_product(e, p_inverse), transposed_product(c, v_inverse)
    information = product(prior, e)
    put_sum(information, information, product(measured, c))
    covariance = np.empty_like(information)
    if not inverse(information, covariance):
        return False
    known, seen = times(prior, x), times(measured, y)
    for i in range(known.size):
        known[i] += seen[i]
    best = times(covariance, known)
    for i in range(best.size):
        augmented[i] = best[i]
    for i in range(n):
        x[i] = best[i]
        for j in range(n):
            p[i, j] = covariance[i, j]
    return True


def augmented_matrices(
    h: FloatArray, f: FloatArray, g: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(E, C) of thesis (2.58)-(2.59) for measurement matrix H, unknown inputs F and G.

    Args:
        h: shape (m, n).
        f: shape (n, q), q may be 0.
        g: shape (m, p), p may be 0.

    Raises:
        ModelError: the measurements do not determine the unknown inputs.
    """
    (m, n), q, unknown = h.shape, f.shape[1], g.shape[1]
    e = np.hstack([np.eye(n), np.zeros((n, unknown)), -f])
    c = np.hstack([h, g, np.zeros((m, q))])
    columns = n + unknown + q
    stacked = np.vstack([e, c / np.maximum(np.abs(c).max(axis=1, keepdims=True), 1e-300)])
    rank = int(np.linalg.matrix_rank(stacked))
    if rank < columns:
        raise ModelError(
            f"unknown-input Kalman filter: found rank {rank} of [E; C], expected {columns}: "
            "an unknown input does not show in any measurement"
        )
    return np.ascontiguousarray(e), np.ascontiguousarray(c)
