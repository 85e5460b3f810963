# ruff: noqa: ARG005 -- laws of one kind take the same arguments
"""Drives and sensors of the mass: what they make of a command, and of position and acceleration."""

import math
from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter, lsim

from rigwatch.wire.arrays import FloatArray

Drive = Callable[[float, float], float]
"""Time and command → force."""


class Follower:
    """An actuator that goes towards its command, at most at a rate [1/s]."""

    def __init__(self, rate: float) -> None:
        self._rate, self._at, self._time = rate, 0.0, 0.0

    def __call__(self, t: float, u: float) -> float:
        """Where it is."""
        most, self._time = self._rate * (t - self._time), t
        self._at = max(self._at - most, min(self._at + most, u))
        return self._at


class Dragged:
    """A spool that its command drags along by a fork with play."""

    def __init__(self, half: float) -> None:
        self._half, self._at = half, 0.0

    def __call__(self, _t: float, u: float) -> float:
        """Where it is."""
        self._at = min(max(self._at, u - self._half), u + self._half)
        return self._at


DRIVES: dict[str, Callable[[], Drive]] = {
    "dead_band_above": lambda: lambda t, u: u if u < 0 else max(u - 0.7, 0.0),
    "dead_band_below": lambda: lambda t, u: u if u > 0 else min(u + 0.7, 0.0),
    "dead_band": lambda: lambda t, u: math.copysign(max(abs(u) - 0.5, 0.0), u),
    "underlap": lambda: lambda t, u: 2 * u if abs(u) < 0.8 else u + math.copysign(0.8, u),
    "compression": lambda: lambda t, u: 12.0 * math.atan(u / 12.0),
    "saturation": lambda: lambda t, u: max(-6.0, min(6.0, u)),
    "curvature": lambda: lambda t, u: 10.0 * (math.exp(u / 20.0) - 1) * 2,
    "asymmetry": lambda: lambda t, u: 1.1 * u if u > 0 else 0.9 * u,
    "gain_drift": lambda: lambda t, u: (1 + 0.03 * t) * u,
    "rate_limit": lambda: Follower(60.0),
    "slew_limit": lambda: Follower(60.0),
    "valve_hysteresis": lambda: Dragged(0.3),
}
"""A force constant that falls as the iron fills, edges of a valve, amplifiers."""

Change = Callable[[FloatArray, float], FloatArray]
"""A signal (n,) and time between its samples [s] → what is read of it."""


def _played(signal: FloatArray, _dt: float) -> FloatArray:
    """Behind a gear with play."""
    shown, at = signal.copy(), float(signal[0])
    for k, x in enumerate(signal):
        at = min(max(at, x - 0.004), x + 0.004)
        shown[k] = at
    return shown


def _stepped(signal: FloatArray, _dt: float) -> FloatArray:
    """A converter with ten steps in the signal's spread."""
    step = 0.1 * signal.std()
    return np.asarray(step * np.round(signal / step))


def _filtered(signal: FloatArray, dt: float) -> FloatArray:
    """An analogue filter of 15 ms."""
    return _low_pass(signal, dt, 0.015)


def _low_pass(signal: FloatArray, dt: float, constant: float) -> FloatArray:
    """A filter of first order of this time constant [s]."""
    time = dt * np.arange(len(signal))
    return np.asarray(lsim(([1.0], [constant, 1.0]), signal, time, signal[0] * constant)[1])


def _early(signal: FloatArray, dt: float) -> FloatArray:
    """With 15 ms of the rate of change."""
    return np.asarray(signal + 0.015 * np.gradient(signal, dt))


def _late(signal: FloatArray, dt: float) -> FloatArray:
    """Sent 20 ms late."""
    time = dt * np.arange(len(signal))
    return np.asarray(np.interp(time - 0.02, time, signal))


def _coupled(signal: FloatArray, dt: float) -> FloatArray:
    """Through a capacitor: high-pass of 0.6 s."""
    slow = lsim(([1.0], [0.6, 1.0]), signal, dt * np.arange(len(signal)))[1]
    return np.asarray(signal - slow)


def _on_a_bracket(signal: FloatArray, dt: float) -> FloatArray:
    """Seen from a bracket that rings at 14 Hz."""
    pole = 2 * math.pi * 14.0
    time = dt * np.arange(len(signal))
    return np.asarray(lsim(([pole**2], [1.0, 0.1 * pole, pole**2]), signal, time)[1])


def _hummed(signal: FloatArray, dt: float) -> FloatArray:
    """The mains, 50 times a second."""
    return np.asarray(signal + 0.3 * np.cos(100 * np.pi * dt * np.arange(len(signal)) + 0.6))


def _smoothed(signal: FloatArray, _dt: float) -> FloatArray:
    """Three tenths of each reading are the one before."""
    return np.asarray(lfilter([0.7], [1.0, -0.3], signal))


def _averaged(signal: FloatArray, _dt: float) -> FloatArray:
    """The mean of four readings."""
    return np.asarray(lfilter(np.full(4, 0.25), [1.0], signal))


OF_ACCELERATION: dict[str, Change] = {
    "hum": _hummed,
    "delay_after_lag": lambda read, dt: _late(_low_pass(read, dt, 0.025), dt),
    "delay": _late,
    "ac_coupling": _coupled,
    "mounting_resonance": _on_a_bracket,
}
OF_POSITION: dict[str, Change] = {
    "sensor_play": _played,
    "lag": _filtered,
    "lead": _early,
    "digital_smoothing": _smoothed,
    "moving_average": _averaged,
    "gain": lambda read, dt: 1.07 * read,
    "offset": lambda read, dt: read + 0.006,
    "drift": lambda read, dt: read + 0.002 * dt * np.arange(len(read)),
    "quantisation": _stepped,
}


def as_read(motion: FloatArray, dt: float, hidden: str) -> FloatArray:
    """What the sensors read of position and acceleration, (n, 2)."""
    position, acceleration = motion.T
    if hidden in OF_POSITION:
        position = OF_POSITION[hidden](position, dt)
    if hidden in OF_ACCELERATION:
        acceleration = OF_ACCELERATION[hidden](acceleration, dt)
    return np.column_stack([position, acceleration])
