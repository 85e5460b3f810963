# ruff: noqa: ARG005 -- laws of one kind take the same arguments
"""A mass on a spring and a damper: contacts, stops, second masses; a drive and sensors.

Symbols: x position [m], v velocity [m/s], u force [N], h step [s], t time [s].
"""

import math
from collections.abc import Callable

import numpy as np

from rigwatch.wire.arrays import FloatArray
from sim_plant.specimens.converters import DRIVES, as_read
from sim_plant.specimens.presliding import PRESLIDING, SlipElement
from sim_plant.specimens.specimen import between, sines
from sim_plant.specimens.springs_and_slides import SLIDES, SPRINGS, STIFFNESS, Contact

MASS, DAMPING = 0.8, 1.5
"""[kg], [N s/m]."""
STEPS = 24
"""Between two samples."""
LINES = np.arange(0.25, 6, 0.25)


def drive(time: FloatArray, seed: int) -> FloatArray:
    """Force [N]."""
    return sines(time, LINES, 4.0, seed)[:, None]


def march(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Position and acceleration as the sensors read them, shape (n, 2)."""
    contact = CONTACTS[hidden]() if hidden in CONTACTS else None
    send = DRIVES[hidden]() if hidden in DRIVES else _as_sent
    x, v, h = 0.0, 0.0, dt / STEPS
    read = np.empty((len(inputs), 2))
    for k in range(len(inputs)):
        for step in range(STEPS):
            t = (k * STEPS + step) * h
            force = send(t, between(inputs, k, step / STEPS)[0]) - STIFFNESS * x - DAMPING * v
            force += contact(t, x, v, h) if contact else 0.0
            if step == 0:
                read[k] = x, force / MASS
            v += h * force / MASS
            x += h * v
    return as_read(read, dt, hidden)


def two_sliders() -> Contact:
    """One that slips early, one that slips late."""
    early, late = SlipElement(0.006, 0.6), SlipElement(0.04, 0.6)
    return lambda t, x, v, h: early(t, x, v, h) + late(t, x, v, h)


class SliderInAFork:
    """A block that lies dry on the table, between two prongs of a fork that the mass carries."""

    def __init__(self, gap: float, force: float) -> None:
        self._half, self._force, self._block = gap / 2, force, 0.0

    def __call__(self, _t: float, x: float, _v: float, _h: float) -> float:
        """The block's force."""
        if abs(x - self._block) <= self._half:
            return 0.0
        side = math.copysign(1.0, x - self._block)
        self._block = x - side * self._half
        return -side * self._force


class InAFork:
    """What a fork with play carries along: it moves only while a prong pushes it."""

    def __init__(self, gap: float, law: Callable[[float, float], float]) -> None:
        self._half, self._law, self._at = gap / 2, law, 0.0

    def __call__(self, _t: float, x: float, _v: float, h: float) -> float:
        """The force of what is carried; its law takes its motion in a step, and the step."""
        before = self._at
        self._at = min(max(before, x - self._half), x + self._half)
        return self._law(self._at - before, h)


class SecondMass:
    """A mass that hangs on the first by a spring and a damper."""

    def __init__(self, mass: float, frequency: float, damping: float) -> None:
        self._mass, self._k = mass, mass * frequency**2
        self._c = 2 * damping * frequency * mass
        self._at, self._speed = 0.0, 0.0

    def __call__(self, _t: float, x: float, v: float, h: float) -> float:
        """The pull of the second mass."""
        pull = self._k * (self._at - x) + self._c * (self._speed - v)
        self._speed -= h * pull / self._mass
        self._at += h * self._speed
        return pull


class SpringAndDashpot:
    """A dashpot on a spring: the spring stretches until the dashpot follows."""

    def __init__(self, stiffness: float, damping: float) -> None:
        self._k, self._c, self._stretched = stiffness, damping, 0.0

    def __call__(self, _t: float, _x: float, v: float, h: float) -> float:
        """The spring's force, which the dashpot carries too."""
        pull = self._k * self._stretched
        self._stretched += h * (v - pull / self._c)
        return -pull


def _bumper(x: float) -> float:
    """Rubber that is touched 6 cm from the middle."""
    return -math.copysign(8e3 * max(abs(x) - 0.06, 0.0) ** 3, x)


CONTACTS: dict[str, Callable[[], Contact]] = {
    **SPRINGS,
    **SLIDES,
    **PRESLIDING,
    "jenkins_behind_gap": lambda: InAFork(0.06, SlipElement(0.015, 0.8).moved),
    "maxwell_slip": two_sliders,
    "slider_behind_gap": lambda: SliderInAFork(0.06, 0.6),
    "viscous_behind_play": lambda: InAFork(0.06, lambda moved, h: -1.5 * moved / h),
    "viscous_beyond_clearance": lambda: lambda t, x, v, h: -2.5 * v if abs(x) > 0.06 else 0.0,
    "cubic_stiffness_beyond_clearance": lambda: lambda t, x, v, h: _bumper(x),
    "maxwell_element": lambda: SpringAndDashpot(40.0, 4.0),
    "digressive_damping": lambda: lambda t, x, v, h: -4.0 * min(max(v, -0.2), 0.2),
    "attached_mass": lambda: SecondMass(0.1, 11.0, 0.06),
    "stop_above": lambda: lambda t, x, v, h: -90.0 * (x - 0.09) if x > 0.09 else 0.0,
    "stop_below": lambda: lambda t, x, v, h: -90.0 * (x + 0.09) if x < -0.09 else 0.0,
    "eddy_brake": lambda: lambda t, x, v, h: -3.0 * v * 0.16 / (0.16 + v * v),
    "force_drift": lambda: lambda t, x, v, h: 0.15 * t,
    "stiffness_drift": lambda: lambda t, x, v, h: 2.5 * t * -x,
    "viscous_drift": lambda: lambda t, x, v, h: 0.12 * t * -v,
    "coulomb_drift": lambda: lambda t, x, v, h: -0.12 * t * math.copysign(1.0, v),
}
"""What pushes the mass besides spring and damper."""


def _as_sent(_t: float, u: float) -> float:
    return u
