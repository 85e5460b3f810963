# ruff: noqa: ARG005 -- laws of one kind take the same arguments
"""A mass on a spring and a damper: contacts, stops, second masses; a drive and sensors.

Symbols: x position [m], v velocity [m/s], u force [N], h step [s], t time [s].
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.signal import lsim

from rigwatch.wire.arrays import FloatArray
from sim_plant.specimens.specimen import between, sines

MASS, DAMPING, STIFFNESS = 0.8, 1.5, 60.0
"""[kg], [N s/m], [N/m]."""
STEPS = 24
"""Between two samples."""
LINES = np.arange(0.25, 6, 0.25)

Contact = Callable[[float, float, float, float], float]
"""Time, position, velocity and step → force."""


def drive(time: FloatArray, seed: int) -> FloatArray:
    """Force [N]."""
    return sines(time, LINES, 4.0, seed)[:, None]


def march(inputs: FloatArray, dt: float, hidden: str) -> FloatArray:
    """Position and acceleration as the sensors read them, shape (n, 2)."""
    contact = CONTACTS[hidden]() if hidden in CONTACTS else None
    send = DRIVES.get(hidden, _as_sent)
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
    return SENSORS[hidden](read, dt) if hidden in SENSORS else read


class SlipElement:
    """A spring in series with a dry slider: it stretches until the slider slips."""

    def __init__(self, stretch: float, force: float) -> None:
        self._most, self._force, self._stretched = stretch, force, 0.0

    def __call__(self, _t: float, _x: float, v: float, h: float) -> float:
        """The slider's force."""
        moved = self._stretched + v * h
        self._stretched = max(-self._most, min(self._most, moved))
        return -self._force * self._stretched / self._most


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


def _curved(u: float) -> float:
    """A force constant that falls as the iron fills."""
    return 12.0 * math.atan(u / 12.0)


DRIVES: dict[str, Callable[[float, float], float]] = {
    "dead_band_above": lambda t, u: u if u < 0 else max(u - 0.7, 0.0),
    "dead_band_below": lambda t, u: u if u > 0 else min(u + 0.7, 0.0),
    "underlap": lambda t, u: 2 * u if abs(u) < 0.8 else u + math.copysign(0.8, u),
    "compression": lambda t, u: _curved(u),
    "gain_drift": lambda t, u: (1 + 0.03 * t) * u,
}
"""Time and command → force."""


def _hummed(read: FloatArray, dt: float) -> FloatArray:
    """The mains at the accelerometer, 50 times a second."""
    time = dt * np.arange(len(read))
    return np.asarray(read + np.outer(np.cos(100 * np.pi * time + 0.6), [0.0, 0.3]))


def _played(read: FloatArray, _dt: float) -> FloatArray:
    """The position behind a gear with play."""
    shown, at = read.copy(), float(read[0, 0])
    for k, x in enumerate(read[:, 0]):
        at = min(max(at, x - 0.004), x + 0.004)
        shown[k, 0] = at
    return shown


def _slow_and_late(read: FloatArray, dt: float) -> FloatArray:
    """An accelerometer with an analogue filter, whose reading is sent 20 ms late."""
    time, shown = dt * np.arange(len(read)), read.copy()
    filtered = lsim(([1.0], [0.025, 1.0]), read[:, 1], time, read[0, 1] * 0.025)[1]
    shown[:, 1] = np.interp(time - 0.02, time, filtered)
    return shown


SENSORS: dict[str, Callable[[FloatArray, float], FloatArray]] = {
    "hum": _hummed,
    "sensor_play": _played,
    "delay_after_lag": _slow_and_late,
}
"""What the sensors make of position and acceleration (n, 2), and time between samples [s]."""
