# ruff: noqa: ARG005 -- laws of one kind take the same, whichever of it they need
"""A block that is heated, balanced as energy; a vessel of gas, balanced as amount; a bearing."""

import math
from collections.abc import Callable

import numpy as np

from rigwatch.wire.arrays import FloatArray
from sim_plant.specimens.specimen import between, sines

STEPS = 12
"""Between two samples."""
SLOW = np.array([0.002, 0.005, 0.011, 0.023, 0.047])
"""Of heat [Hz]."""
LINES = np.array([0.05, 0.12, 0.31, 0.7, 1.3])
"""Of gas [Hz]."""


def heat(time: FloatArray, seed: int) -> FloatArray:
    """Power of a heater [W] and temperature of the room [K]."""
    power = np.abs(sines(time, SLOW, 160.0, seed, 200.0))
    return np.column_stack([power, sines(time, SLOW[:2], 2.0, seed + 1, 293.0)])


def _nothing(*_: float | FloatArray) -> float:
    return 0.0


LOSSES: dict[str, Callable[[float, float], float]] = {
    "convection": lambda hot, room: 1.5 * (hot - room),
    "free_convection": lambda hot, room: 0.6 * math.copysign(abs(hot - room) ** 1.25, hot - room),
    "radiation": lambda hot, room: 5.67e-8 * 0.15 * (hot**2 + room**2) * (hot**2 - room**2),
}
"""Temperatures of block and room [K] → power that leaves [W]."""
CAPACITY, CONDUCTANCE = 400.0, 1.2
"""[J/K], [W/K]."""


def warm(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Temperature of the block [K], shape (n, 1); losses other than convection are known."""
    lost = LOSSES.get(hidden, _nothing)
    known = 0.0 if hidden == "convection" else CONDUCTANCE
    energy, h = CAPACITY * 293.0, dt / STEPS
    read = np.empty((len(inputs), 1))
    for k in range(len(inputs)):
        read[k] = energy / CAPACITY
        for step in range(STEPS):
            power, room = between(inputs, k, step / STEPS)
            hot = energy / CAPACITY
            energy += h * (power - known * (hot - room) - lost(hot, room))
    return read


OUTSIDE = 1.01e5
"""[Pa]."""
VOLUME, LAMINAR = 1e-3, 2e-4
"""[m^3], [m^3/s]."""


def gas(time: FloatArray, seed: int) -> FloatArray:
    """Flow into the vessel [Pa m^3/s] and pressure outside [Pa]."""
    flow = sines(time, LINES, 12.0, seed, 2.0)
    return np.column_stack([flow, np.full(len(time), OUTSIDE)])


def _nozzle(inside: float) -> float:
    """Flow at the speed of sound up to half the pressure, an ellipse from there."""
    share = min(OUTSIDE / inside, 1.0)
    slower = 1.0 if share < 0.5 else math.sqrt(1.0 - (2.0 * share - 1.0) ** 2)
    return 3e-5 * inside * slower if inside > OUTSIDE else 0.0


def _valve(above: float) -> float:
    return 1.2e-4 * above if above > 0 else 0.0


OUTLETS: dict[str, Callable[[float], float]] = {
    "choked_flow": lambda above: _nozzle(above + OUTSIDE),
    "one_way_flow": _valve,
    "one_way_flow_back": lambda above: -_valve(-above),
    "overflow": lambda above: 3e-4 * (above - 1.2e4) if above > 1.2e4 else 0.0,
    "orifice": lambda above: math.copysign(0.02 * math.sqrt(abs(above)), above),
    "cavitating_flow": lambda above: 1.5e-4 * math.copysign(min(abs(above), 7e3), above),
}
"""Pressure above the outside [Pa] → flow that leaves [Pa m^3/s]."""


def fill(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Pressure in the vessel [Pa], shape (n, 1)."""
    out = OUTLETS.get(hidden, _nothing)
    amount, h = OUTSIDE * VOLUME, dt / STEPS
    read = np.empty((len(inputs), 1))
    for k in range(len(inputs)):
        read[k] = amount / VOLUME
        for step in range(STEPS):
            above = amount / VOLUME - OUTSIDE
            amount += h * (between(inputs, k, step / STEPS)[0] - LAMINAR * above - out(above))
    return read


def turn(time: FloatArray, seed: int) -> FloatArray:
    """Speed of a bearing [rad/s], its side load [N] and its warming [K]."""
    speed = sines(time, LINES, 30.0, seed, 5.0)
    load = sines(time, LINES[:3], 40.0, seed + 1, 60.0)
    warmer = 30.0 * (1.0 - np.exp(-time / (0.4 * time[-1]))) + sines(time, LINES[:2], 3.0, seed + 2)
    return np.column_stack([speed, load, warmer])


TORQUES: dict[str, Callable[[FloatArray, FloatArray, FloatArray], float | FloatArray]] = {
    "viscous_by_temperature": lambda speed, load, warmer: -2e-5 * warmer * speed,
    "coulomb_by_temperature": lambda speed, load, warmer: 1e-3 * warmer * np.sign(speed),
    "zero_by_temperature": lambda speed, load, warmer: 1e-3 * warmer,
    "gain_by_temperature": lambda speed, load, warmer: 3e-3 * (2e-3 * speed + 0.1) * warmer,
    "cross_axis": lambda speed, load, warmer: 5e-4 * load,
    "load_dependent": lambda speed, load, warmer: 3e-4 * np.abs(load) * np.sign(speed),
}
"""What the torque is more than it should be [N m]."""


def rub(inputs: FloatArray, _dt: float, hidden: str) -> FloatArray:
    """Torque of the bearing [N m], shape (n, 1)."""
    more = TORQUES.get(hidden, _nothing)
    zero = 0.1
    return np.asarray((2e-3 * inputs[:, 0] + zero + more(*inputs.T))[:, None])
