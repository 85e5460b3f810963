"""Windings in terms of flux, and what motors and a coil in a magnet's gap move, in momenta."""

import math
from collections.abc import Callable

import numpy as np

from rigwatch.wire.arrays import FloatArray
from sim_plant.specimens.specimen import between, sines

STEPS = 24
"""Between two samples."""
LINES = np.array([0.7, 1.9, 4.3, 9.1, 14.0])
"""[Hz]."""
RESISTANCE, INDUCTANCE = 1.2, 0.06
"""[ohm], [H]."""
BATTERY, INNER = 18.0, 0.5
"""Supply of a chopper: [V], [ohm]."""
LIMIT, GIVES_WAY = 3.0, 0.15
"""A drive gives less voltage above a current [A], the less the more flows beyond it [V/A^2]."""


def volts(time: FloatArray, seed: int) -> FloatArray:
    """Voltage [V], speed of the rotor [rad/s] and warming of the winding [K]."""
    warmer = 60.0 * time / time[-1] + sines(time, LINES[:1], 5.0, seed + 1)
    return np.column_stack([
        sines(time, LINES, 6.0, seed), sines(time, LINES, 20.0, seed + 2), warmer
    ])  # fmt: skip


def _magnetising(flux: float) -> float:
    """Current of an iron core that saturates softly [A]."""
    return flux / INDUCTANCE * (1 + 12.0 * flux * flux)


def conduct(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Current of the winding [A], shape (n, 1)."""
    flux, h = 0.0, dt / STEPS
    read = np.empty((len(inputs), 1))
    for k in range(len(inputs)):
        for step in range(STEPS):
            volt, speed, warmer = between(inputs, k, step / STEPS)
            current = flux / INDUCTANCE
            if hidden == "saturating_inductance":
                current = _magnetising(flux)
            if step == 0:
                read[k] = current
            copper = 1 + 0.0039 * warmer if hidden == "resistance_by_temperature" else 1.0
            induced = 0.05 * speed if hidden == "back_emf" else 0.0
            brushes = math.copysign(0.6, current) if hidden == "brush_drop" else 0.0
            if hidden == "supply_sag":
                share = volt / BATTERY
                volt = share * (BATTERY - INNER * share * current)
            if hidden == "current_limit" and abs(current) > LIMIT:
                volt -= math.copysign(GIVES_WAY * (abs(current) - LIMIT) ** 2, current)
            flux += h * (volt - RESISTANCE * copper * current - brushes - induced)
    return read


TORQUE, MOTOR, LOAD, SHAFT, LOSS = 0.1, 1.2e-3, 2e-3, 15.0, 0.02
"""[N m/A], [kg m^2], [kg m^2], [N m/rad], [N m s/rad]."""


def amps(time: FloatArray, seed: int) -> FloatArray:
    """Current of the motor [A], with a mean that keeps it turning."""
    return sines(time, LINES, 2.0, seed, 0.3)[:, None]


def _as_sent(amp: float, _angle: float) -> float:
    return amp


PUSHES: dict[str, Callable[[float, float], float]] = {
    "commutation_ripple": lambda amp, angle: amp * (1 + 0.2 * math.cos(2 * angle)),
}
"""Command and angle of the rotor → current."""


def turn_load(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Speeds of motor and load [rad/s], shape (n, 2)."""
    push = PUSHES.get(hidden, _as_sent)
    angle, beyond, own, driven, h = 0.0, 0.0, 0.0, 0.0, dt / STEPS
    read = np.empty((len(inputs), 2))
    for k in range(len(inputs)):
        for step in range(STEPS):
            speed, load = own / MOTOR, driven / LOAD
            if step == 0:
                read[k] = speed, load
            through = SHAFT * (angle - beyond) + LOSS * (speed - load)
            amp = push(between(inputs, k, step / STEPS)[0], angle)
            own += h * (TORQUE * amp - through - 2e-3 * speed)
            driven += h * (through - 1e-3 * load)
            angle += h * own / MOTOR
            beyond += h * driven / LOAD
    return read


CABLE, INERTIA, FRICTION = 0.3, 1e-3, 2e-4
"""[ohm], [kg m^2], [N m s/rad]."""
MOTOR_INDUCTANCE = 0.01
"""[H]."""


def armature(time: FloatArray, seed: int) -> FloatArray:
    """Voltage of a motor [V], which turns both ways."""
    return sines(time, LINES, 8.0, seed)[:, None]


def spin(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Speed of a motor behind a cable [rad/s], shape (n, 1); its winding is on the data sheet."""
    flux, turning, h = 0.0, 0.0, dt / STEPS
    cable = CABLE if hidden == "series_resistance" else 0.0
    read = np.empty((len(inputs), 1))
    for k in range(len(inputs)):
        for step in range(STEPS):
            speed, current = turning / INERTIA, flux / MOTOR_INDUCTANCE
            if step == 0:
                read[k] = speed
            volt = between(inputs, k, step / STEPS)[0]
            flux += h * (volt - (1.0 + cable) * current - TORQUE * speed)
            turning += h * (TORQUE * current - FRICTION * speed)
    return read


GAP_STEPS = 96
"""Between two samples: the coil's current settles within few of them."""
TONES = np.array([7.0, 19.0, 41.0, 83.0, 151.0, 290.0])
"""[Hz]."""
COIL, OWN, IRON, SHARED = 5.0, 4e-3, 3e-3, 2e-3
"""[ohm]; inductances of the coil, of the currents in the iron around it, and mutual [H]."""
IN_IRON = 6.0
"""[ohm]."""
STRENGTH, MOVING, SUSPENSION, DAMPING = 7.0, 0.02, 1800.0, 1.2
"""[N/A], [kg], [N/m], [N s/m]."""


def _even(_x: float) -> float:
    return STRENGTH


FACTORS: dict[str, Callable[[float], float]] = {
    "gain_along_travel": lambda x: STRENGTH * math.exp(-x / 0.05),
    "gain_towards_ends": lambda x: STRENGTH / (1 + (x / 0.012) ** 2),
}
"""Position [m] → force of the coil per current."""


def amplified(time: FloatArray, seed: int) -> FloatArray:
    """Voltage of a coil [V]."""
    return sines(time, TONES, 8.0, seed)[:, None]


def shake(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Travel [m] and current [A] of a coil in the gap of a magnet, shape (n, 2).

    Currents in the iron are those of a second winding, which is shorted.
    """
    factor_at = FACTORS.get(hidden, _even)
    shared = SHARED if hidden == "eddy_currents" else 0.0
    apart = OWN * IRON - shared * shared
    flux, ring, x, pushed, h = 0.0, 0.0, 0.0, 0.0, dt / GAP_STEPS
    read = np.empty((len(inputs), 2))
    for k in range(len(inputs)):
        for step in range(GAP_STEPS):
            amp = (IRON * flux - shared * ring) / apart
            eddy = (OWN * ring - shared * flux) / apart
            if step == 0:
                read[k] = x, amp
            factor, speed = factor_at(x), pushed / MOVING
            volt = between(inputs, k, (step + 0.5) / GAP_STEPS)[0]
            flux += h * (volt - COIL * amp - factor * speed)
            ring -= h * IN_IRON * eddy
            pushed += h * (factor * amp - DAMPING * speed - SUSPENSION * x)
            x += h * pushed / MOVING
    return read
