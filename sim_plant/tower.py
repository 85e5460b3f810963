"""An offshore tower in waves, and a pendulum balanced on a cart: the other two examples' records.

The tower (Imai et al.; thesis 2.32) is z̈ + J·ż − D·(u − ż)·|u − ż| + K·z = L·u̇ with the water's
velocity u at two depths, a sum of sines that fade with depth. The pendulum (Nowakowski et al.;
thesis 2.52-2.53) is balanced by state feedback while a sum of sines pushes its cart. Both are
integrated by DOP853 to ten digits; neither source prints its figures, so these are chosen.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from sim_plant.structure import sample_times

Floats = NDArray[np.float64]

J = np.array([[0.30, -0.10], [-0.08, 0.15]])
K = np.array([[6.0, -3.0], [-2.4, 2.4]])
D, L = np.array([0.15, 0.25]), np.array([0.5, 0.7])
WAVES = np.array([[0.6, 0.7, 0.3], [0.5, 1.3, 1.9], [0.4, 2.1, 4.0], [0.3, 2.9, 0.8]])
"""Amplitude at the surface [m/s], angular frequency [rad/s] and phase of each wave."""
DEPTHS = np.array([12.0, 3.0])
GRAVITY = 9.81

MASS, MOMENT, INERTIA, CART_DRAG, PIVOT_DAMPING = 0.7, 0.06, 0.024, 0.1, 0.002
FEEDBACK = np.array([-3.0, -4.0, -35.0, -7.0])
"""Of x, v, φ and w into the force [N per unit]."""
PUSHES = np.array([[1.5, 2.3, 0.0], [1.0, 5.1, 1.0], [0.7, 9.7, 2.0], [0.5, 17.0, 3.0]])


@dataclass(frozen=True, eq=False)
class Columns:
    """Signals sampled together.

    Attributes:
        time: shape (n,) [s].
        columns: by name, each of shape (n,).
    """

    time: Floats
    columns: dict[str, Floats]


def water(time: Floats) -> tuple[Floats, Floats]:
    """Velocity and acceleration of the water at both masses, each of shape (2, n)."""
    amplitude, omega, phase = (column[:, None, None] for column in WAVES.T)
    fade = np.exp(-(omega**2) * DEPTHS[None, :, None] / GRAVITY * 0.25)
    angle = omega * np.asarray(time)[None, None, :] + phase
    return (amplitude * fade * np.sin(angle)).sum(0), (
        amplitude * fade * omega * np.cos(angle)
    ).sum(0)


def tower(dt: float, duration: float) -> Columns:
    """Positions z1, z2 of the tower and the forces of the water on both masses."""

    def rates(t: float, state: Floats) -> Floats:
        u, du = (part[:, 0] for part in water(np.array([t])))
        z, w = state[:2], state[2:]
        slip = u - w
        return np.concatenate([w, -J @ w - K @ z + D * slip * np.abs(slip) + L * du])

    time, states = _solved(rates, 4, dt, duration)
    u, du = water(time)
    names = ("z1", "z2", "water_velocity1", "water_velocity2")
    columns = dict(zip(names, (*states[:2], *u), strict=True))
    return Columns(time, columns | {"water_acceleration1": du[0], "water_acceleration2": du[1]})


def pendulum(dt: float, duration: float) -> Columns:
    """Force on the cart, held over each sample, and its position, velocity and the angle."""
    time = sample_times(dt, duration)
    states, forces = np.zeros((len(time), 4)), np.zeros(len(time))
    for k, t in enumerate(time):
        forces[k] = -FEEDBACK @ states[k] + float(
            np.sum(PUSHES[:, 0] * np.sin(PUSHES[:, 1] * t + PUSHES[:, 2]))
        )
        if k + 1 < len(time):
            step = solve_ivp(
                lambda _, s, f=forces[k]: _pendulum_rates(s, f), (0.0, dt), states[k],
                method="DOP853", rtol=1e-10, atol=1e-12,
            )  # fmt: skip
            states[k + 1] = step.y[:, -1]
    x, v, phi, _ = states.T
    return Columns(time, {"force": forces, "x": x, "v": v, "phi": phi})


def _pendulum_rates(state: Floats, force: float) -> Floats:
    _, v, phi, w = state
    coupling = MOMENT * np.cos(phi)
    matrix = np.array([[INERTIA, coupling], [coupling, MASS]])
    right = [
        MOMENT * GRAVITY * np.sin(phi) - PIVOT_DAMPING * w,
        force - CART_DRAG * v + MOMENT * w**2 * np.sin(phi),
    ]
    angular, linear = np.linalg.solve(matrix, right)
    return np.array([v, linear, w, angular])


def _solved(
    rates: Callable[[float, Floats], Floats], size: int, dt: float, duration: float
) -> tuple[Floats, Floats]:
    time = sample_times(dt, duration)
    run = solve_ivp(
        rates, (0.0, time[-1]), np.zeros(size), method="DOP853", t_eval=time, rtol=1e-10, atol=1e-12
    )
    return time, np.asarray(run.y)
