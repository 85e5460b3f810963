"""Two tanks, balanced as volumes; the seal of a cylinder that is moved."""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from sim_plant.specimens.specimen import sines

GRAVITY = 9.81
"""[m/s^2]."""
AREA, PUMP, HOLE = 0.003, 4e-6, 7e-6
"""Of a tank [m^2], of the pump [m^3/(s V)], of an outlet [m^2]."""
SPOILT = 6e-6
"""Flow through a porous wall of the upper tank, by its level [m^2/s]."""
STEPS = 10
"""Between two samples."""


def pumped(time: FloatArray, seed: int) -> FloatArray:
    """Voltage of the pump [V], kept for half a minute at a time."""
    levels = np.random.default_rng(seed).uniform(1.0, 6.0, len(time))
    return np.asarray(levels[(time // 30.0).astype(int)][:, None])


def drain(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Levels of the tanks [m], shape (n, 2)."""
    upper = lower = 0.2 * AREA
    h, leak = dt / STEPS, SPOILT if hidden == "leakage" else 0.0
    read = np.empty((len(inputs), 2))
    for k, volts in enumerate(inputs[:, 0].tolist()):
        read[k] = upper / AREA, lower / AREA
        for _ in range(STEPS):
            first = HOLE * (2 * GRAVITY * max(upper, 0.0) / AREA) ** 0.5
            second = HOLE * (2 * GRAVITY * max(lower, 0.0) / AREA) ** 0.5
            upper += h * (PUMP * volts - first - leak * upper / AREA)
            lower += h * (first - second)
    return read


LINES = np.array([0.1, 0.23, 0.41, 0.77, 1.3])
"""Of the stroke [Hz]."""
PISTON = 5.187e-4
"""[m^2]."""


def stroked(time: FloatArray, seed: int) -> FloatArray:
    """Pressure [Pa], position [m] and speed [m/s] of a piston."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(LINES))
    angles = 2 * np.pi * np.outer(time, LINES) + phases
    position = 0.02 * np.sin(angles).sum(axis=1)
    speed = 0.02 * (2 * np.pi * LINES * np.cos(angles)).sum(axis=1)
    return np.column_stack([sines(time, LINES[:2], 3e4, seed + 1, 2e5), position, speed])


def pull(inputs: FloatArray, _dt: float, hidden: str) -> FloatArray:
    """Force at the rod [N], shape (n, 1)."""
    pressure, position, speed = inputs.T
    hose = 150.0 * position if hidden == "linear_stiffness" else 0.0
    film = 20.0 * speed if hidden == "viscous" else 0.0
    return np.asarray((PISTON * pressure - 12.0 + hose + film)[:, None])
