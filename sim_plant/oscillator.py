"""A mass on a spring and damper with one or two hidden effects: a plant to be explained.

    m·dv/dt = F(u) − k·x − c·v + hidden(x, v, memory, t),    dx/dt = v

It has its own equations and integrator: velocity first, then position (leapfrog: velocity is half a
step behind, and forces that depend on it extrapolate it), with 64 steps per sample, and dry
friction with true sticking (D. Karnopp, 1985: below a speed that friction can stop within a step,
the mass is held while the other forces are weaker).

Symbols: x position [m], v velocity [m/s], u commanded force [N], F force that acts [N].
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel
from sim_plant.strengths import largest_share, strength_at

RATE = 256.0
"""Sample rate [Hz]."""
LARGEST = 40.0
"""Force at which the drive saturates, divided by 1 + the strength [N]."""
STEPS = 64
"""Integration steps between two samples."""
MASS, DAMPING, STIFFNESS = 0.8, 1.5, 60.0
"""[kg], [N s/m], [N/m]."""

EFFECTS: tuple[str, ...] = (
    "coulomb", "stribeck", "dahl", "quadratic_drag", "constant_force", "cubic_stiffness",
    "quadratic_stiffness", "hard_stop", "backlash", "bouc_wen", "end_binding",
    "viscous_by_direction", "dead_band", "saturation", "valve_hysteresis", "delay",
    "acceleration_lag", "position_lag", "acceleration_gain", "position_offset", "position_drift",
    "van_der_pol", "maxwell", "pulsating_spring", "knocks",
    "acceleration_smoothing", "position_smoothing", "drive_smoothing",
    "acceleration_average", "position_average", "drive_average",
)  # fmt: skip
"""Names of the hidden effects; those in `UNKNOWN` are not in any library."""
DIGITAL = EFFECTS[-6:]
"""Digital filters, computed sample by sample: y'(k) = s·y'(k-1) + (1-s)·y(k), or a mean of 1+s
samples, rounded up. At the drive they apply only if the force is held from sample to sample.
"""
UNKNOWN = ("van_der_pol", "maxwell", "pulsating_spring", "knocks")


@dataclass(frozen=True)
class Hidden:
    """A hidden effect.

    Attributes:
        name: one of `EFFECTS`.
        strength: in the effect's own unit.
    """

    name: str
    strength: float


def oscillate(
    force: FloatArray,
    hidden: tuple[Hidden, ...],
    noise: FloatArray,
    seed: int,
    *,
    held: bool = False,
) -> FloatArray:
    """Position [m] and acceleration [m/s^2] as the sensors read them, shape (n, 2).

    Args:
        force: commanded, shape (n,) [N].
        hidden: hidden effects, none for a healthy plant.
        noise: standard deviations of the two sensors' white noise, shape (2,).
        seed: seed of the noise.
        held: whether the force is held from sample to sample, as by a converter; else linear.
    """
    strengths = np.zeros(len(EFFECTS))
    for effect in hidden:
        strengths[EFFECTS.index(effect.name)] = effect.strength
    digital = {effect.name: effect.strength for effect in hidden if effect.name in DIGITAL}
    sent = _digital(np.asarray(force, np.float64), "drive", digital)
    clean = np.empty((len(force), 2))
    _run(np.ascontiguousarray(sent), strengths, held, clean)
    clean[:, 0] = _digital(clean[:, 0], "position", digital)
    clean[:, 1] = _digital(clean[:, 1], "acceleration", digital)
    return clean + noise * np.random.default_rng(seed).normal(size=clean.shape)


def _digital(signal: FloatArray, where: str, strengths: Mapping[str, float]) -> FloatArray:
    """The digital filtering of a signal's samples."""
    if share := min(strengths.get(f"{where}_smoothing", 0.0), 0.995):
        signal = lfilter([1 - share], [1, -share], signal, zi=[share * signal[0]])[0]
    if count := 1 + math.ceil(strengths.get(f"{where}_average", 0.0) - 1e-9):
        before = np.concatenate([np.full(count - 1, signal[0]), signal])
        signal = np.convolve(before, np.full(count, 1 / count), "valid")
    return np.asarray(signal, np.float64)


def strength_for(name: str, force: FloatArray, share: float, *, held: bool = False) -> float:
    """The strength at which an effect changes the outputs by `share` of their rms.

    The larger share of both channels counts.

    Args:
        name: one of `EFFECTS`.
        force: commanded, shape (n,) [N].
        share: for example 0.05.
        held: whether the force is held from sample to sample.
    """
    silent = np.zeros(2)
    healthy = oscillate(force, (), silent, 0, held=held)
    size = np.sqrt(np.mean(healthy**2, axis=0))

    def caused(strength: float) -> float:
        moved = oscillate(force, (Hidden(name, strength),), silent, 0, held=held) - healthy
        return largest_share(moved, size)

    return strength_at(share, caused, least=1e-6)


@kernel()
def _clipped(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


@kernel()
def _run(force: FloatArray, s: FloatArray, held: bool, out: FloatArray) -> None:  # noqa: C901, PLR0912, PLR0915 -- a kernel
    h = 1.0 / (RATE * STEPS)
    x, v, a, played, bent, yielded, branch = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    slow_x, slow_a = 0.0, 0.0
    late = round(s[15] / h) if s[15] > 0 else 0
    for k in range(len(force)):
        read_x, read_a = x, 0.0
        for step in range(STEPS):
            place = k * STEPS + step - late
            row, part = max(place, 0) // STEPS, (max(place, 0) % STEPS) / STEPS
            following = row if held else min(row + 1, len(force) - 1)
            u = force[row] + part * (force[following] - force[row])
            t = (k * STEPS + step) * h
            if s[12] > 0:
                u = u - _clipped(u, s[12])
            if s[13] > 0:
                u = _clipped(u, LARGEST / (1.0 + s[13]))
            if s[14] > 0:
                played = min(max(played, u - s[14]), u + s[14])
                u = played
            now = v + 0.5 * h * a
            other = u - STIFFNESS * x - DAMPING * now
            other -= s[3] * now * abs(now) + s[5] * x**3 + s[6] * x * x + s[11] * abs(now)
            other += s[4]
            stop = 0.12
            if abs(x) > stop:
                other -= s[7] * (x - np.sign(x) * stop)
            other += s[8] * _clipped(x, 0.02)
            if s[9] > 0:
                yielded += h * (
                    v
                    - 0.5 * abs(v) * yielded * abs(yielded) / 0.0025
                    - 0.5 * v * yielded**2 / 0.0025
                )
                other -= s[9] * yielded
            if s[2] > 0:
                bent += h * 50.0 * v * (1.0 - bent * np.sign(v))
                other -= s[2] * bent
            other -= s[21] * x * x * now
            if s[22] > 0:
                branch += h * (v - 2.0 * branch)
                other -= s[22] * branch
            other -= s[23] * np.sin(2 * np.pi * 0.7 * t) * x
            if s[24] > 0 and (t % 1.7) < 0.02:
                other += s[24]
            dry = s[0] + s[1] * np.exp(-((now / 0.08) ** 2)) + s[10] * (x / 0.1) ** 4
            if dry > 0 and abs(v) * MASS < dry * h and abs(other) <= dry:
                a, v = 0.0, 0.0
            else:
                towards = np.sign(v) if v != 0.0 else np.sign(other)
                a = (other - dry * towards) / MASS
                following_v = v + h * a
                crosses = dry > 0 and v != 0.0 and np.sign(following_v) != np.sign(v)
                v = 0.0 if crosses and abs(other) <= dry else following_v
            if step == 0:
                if k == 0:
                    slow_a, slow_x = a, x
                read_a = slow_a if s[16] > 0 else a
                read_x = slow_x if s[17] > 0 else x
            x += h * v
            if s[17] > 0:
                slow_x += (x - slow_x) * -np.expm1(-h / s[17])
            if s[16] > 0:
                slow_a += (a - slow_a) * -np.expm1(-h / s[16])
        out[k, 0] = read_x + s[19] + s[20] * k / RATE
        out[k, 1] = read_a * (1.0 + s[18])
