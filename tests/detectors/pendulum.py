"""The example of Nowakowski, Boutayeb and Darouach: a pendulum on a cart (thesis 2.52-2.53).

    J·φ'' + C·φ' - Mp·l·g·sin φ + Mp·l·xc''·cos φ = 0
    M·xc'' + Fx·xc' + Mp·l·(φ''·cos φ - φ'²·sin φ) = F

The thesis prints no figures. Chosen: the textbook pendulum with cart 0.5 kg, rod 0.2 kg, half
length 0.3 m, inertia 0.006 kg·m², cart friction 0.1 N·s/m (so M = 0.7 kg, Mp = 0.2 kg, J = 0.024
kg·m²), sampled every 10 ms, balanced by linear state feedback. Measured are cart position, angle
and cart velocity, the usual three of a laboratory pendulum; the position sensor gets a constant
bias.
"""

import numpy as np
from scipy.linalg import solve_discrete_are

from monitor.detectors.innovation_test import new_nis_window, push_nis
from monitor.detectors.kalman import augmented_matrices, generalised_update, kalman_update
from monitor.detectors.small_matrices import product, product_transposed
from rigwatch.wire.kernel import kernel

STEP = 0.01
INERTIA, DAMPING, MASS, ROD, LENGTH, CART, GRAVITY = 0.024, 0.002, 0.7, 0.2, 0.3, 0.1, 9.81
W = np.diag([1e-10, 1e-6, 1e-10, 1e-5])
V = np.diag([1e-3, 2e-3, 5e-3]) ** 2
SPREAD, NOISE = np.sqrt(np.diag(W)), np.sqrt(np.diag(V))
V_INVERSE = np.diag(1.0 / np.diag(V))
H = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, 1.0, 0, 0]])
POSITION_BIAS = np.array([[1.0], [0.0], [0.0]])


@kernel(allocates=True)
def derivative(x, force):
    """d/dt of (xc, xc', φ, φ')."""
    sine, cosine = np.sin(x[2]), np.cos(x[2])
    coupling = ROD * LENGTH
    torque = coupling * GRAVITY * sine - DAMPING * x[3]
    push = force - CART * x[1] + coupling * x[3] ** 2 * sine
    determinant = INERTIA * MASS - (coupling * cosine) ** 2
    angle = (MASS * torque - coupling * cosine * push) / determinant
    cart = (INERTIA * push - coupling * cosine * torque) / determinant
    return np.array([x[1], cart, x[3], angle])


@kernel(allocates=True)
def advanced(x, force):
    """The state one sample later, by Runge and Kutta's fourth-order step."""
    k1 = derivative(x, force)
    k2 = derivative(x + 0.5 * STEP * k1, force)
    k3 = derivative(x + 0.5 * STEP * k2, force)
    k4 = derivative(x + STEP * k3, force)
    return x + STEP / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)


@kernel(allocates=True)
def jacobian(x, force):
    """Φ: derivative of `advanced` after the state, by central differences."""
    phi = np.empty((4, 4))
    for j in range(4):
        step = np.zeros(4)
        step[j] = 1e-5
        phi[:, j] = (advanced(x + step, force) - advanced(x - step, force)) / 2e-5
    return phi


def feedback() -> np.ndarray:
    """Gain of the balancing force, from the linearised pendulum."""
    origin = np.zeros(4)
    phi = jacobian(origin, 0.0)
    gamma = ((advanced(origin, 1e-3) - advanced(origin, -1e-3)) / 2e-3)[:, None]
    weight = np.diag([4.0, 0.5, 20.0, 1.0])
    p = solve_discrete_are(phi, gamma, weight, np.eye(1))
    return np.linalg.solve(1.0 + gamma.T @ p @ gamma, gamma.T @ p @ phi)[0]


def simulated(seconds: float, bias: float, at: float, seed: int):
    """Force, measurements and true states; the sensor's bias comes `at` [s].

    The feedback uses the true state, so that the fault is in the reading alone.
    """
    n, rng = round(seconds / STEP), np.random.default_rng(seed)
    push, noise = rng.standard_normal((n, 4)) * SPREAD, rng.standard_normal((n, 3)) * NOISE
    noise[round(at / STEP) :, 0] += bias
    return balanced(feedback(), push, noise)


@kernel(allocates=True)
def balanced(gain, push, noise):
    """Force, measurements and states under state feedback that follows a slow sine."""
    n = len(push)
    x = np.array([0.0, 0.0, 0.05, 0.0])
    force, y, states = np.empty(n), np.empty((n, 3)), np.empty((n, 4))
    for k in range(n):
        wanted = 0.2 * np.sin(2 * np.pi * 0.2 * k * STEP)
        force[k] = -gain[0] * (x[0] - wanted) - gain[1] * x[1] - gain[2] * x[2] - gain[3] * x[3]
        states[k] = x
        y[k, 0], y[k, 1], y[k, 2] = x[0] + noise[k, 0], x[2] + noise[k, 1], x[1] + noise[k, 2]
        x = advanced(x, force[k]) + push[k]
    return force, y, states


@kernel(allocates=True)
def both_filters(force, y, augmented, noise, window):
    """Both filters: innovations, their windowed sum, the angle's innovation, bias, states."""
    (e, c, h), (w, v, v_inverse) = augmented, noise
    n = force.size
    nis, total, bias = np.empty(n), np.empty(n), np.empty(n)
    white, general = np.empty(n), np.empty((n, 4))
    x, p = np.array([0.0, 0.0, 0.05, 0.0]), 1e-4 * np.eye(4)
    z, pz = x.copy(), p.copy()
    found = np.zeros(5)
    for k in range(n):
        if k > 0:
            phi = jacobian(x, force[k - 1])
            x, p = advanced(x, force[k - 1]), product_transposed(product(phi, p), phi) + w
            phi = jacobian(z, force[k - 1])
            z, pz = advanced(z, force[k - 1]), product_transposed(product(phi, pz), phi) + w
        white[k] = (y[k, 1] - x[2]) / np.sqrt(p[2, 2] + v[1, 1])
        nis[k] = kalman_update(x, p, h, v, y[k])
        total[k] = push_nis(window, nis[k])
        generalised_update(z, pz, e, c, v_inverse, y[k], found)
        bias[k], general[k] = found[4], z
    return nis, total, white, bias, general


def filtered(force, y, length=20):
    """What `both_filters` makes of the measurements."""
    matrices = (*augmented_matrices(H, np.zeros((4, 0)), POSITION_BIAS), H)
    return both_filters(force, y, matrices, (W, V, V_INVERSE), new_nis_window(length))


def run(seconds: float, bias: float = 0.0, at: float = 0.0, seed: int = 0, length: int = 20):
    """Simulate and filter; (nis, total, white, bias, fault-free states, true states)."""
    force, y, states = simulated(seconds, bias, at, seed)
    return *filtered(force, y, length), states
