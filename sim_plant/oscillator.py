"""A mass on a spring and damper with one or two hidden effects: a plant to be explained.

    m·dv/dt = F(u) − k·x − c·v + hidden(x, v, memory, t),    dx/dt = v

It has its own equations and integrator: velocity first, then position (leapfrog: velocity is half a
step behind, and forces that depend on it extrapolate it), with 64 steps per sample, and dry
friction with true sticking (D. Karnopp, 1985: below a speed that friction can stop within a step,
the mass is held while the other forces are weaker).

Symbols: x position [m], v velocity [m/s], u commanded force [N], F force that acts [N].
"""

# Fields of a record are known to numba, not to mypy.
# mypy: disable-error-code="no-any-return"

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part
from sim_plant.strengths import largest_share, strength_at

RATE = 256.0
"""Sample rate [Hz]."""
LARGEST = 40.0
"""Force at which the drive saturates, divided by 1 + the strength [N]."""
STEPS = 64
"""Integration steps between two samples."""
H = 1.0 / (RATE * STEPS)
"""Length of a step [s]."""
MASS, DAMPING, STIFFNESS = 0.8, 1.5, 60.0
"""[kg], [N s/m], [N/m]."""
STOP, GAP = 0.12, 0.02
"""Travel to the hard stop, and half of the gap in which backlash takes the spring away [m]."""

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

Record = Any
"""One record of a structured array; numba compiles its fields as attributes."""
STRENGTHS = np.dtype([(name, np.float64) for name in EFFECTS])
MEMORY = np.dtype(
    [(name, np.float64) for name in ("played", "yielded", "bent", "branch", "slow_x", "slow_a")]
)
"""States of the valve's hysteresis, of Bouc and Wen, Dahl and Maxwell, and of slow sensors."""


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
    strengths = np.zeros(1, STRENGTHS)
    for effect in hidden:
        strengths[effect.name] = effect.strength
    digital = {effect.name: effect.strength for effect in hidden if effect.name in DIGITAL}
    sent = _digital(np.asarray(force, np.float64), "drive", digital)
    clean = np.empty((len(force), 2))
    _run(np.ascontiguousarray(sent), strengths, held, clean, np.zeros(1, MEMORY))
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


@part()
def _clipped(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


@part()
def _drive_force(force: FloatArray, place: int, held: bool) -> float:
    """The force at a step, between the samples of `force` [N]."""
    place = max(place, 0)
    row, part = place // STEPS, (place % STEPS) / STEPS
    following = row if held else min(row + 1, len(force) - 1)
    return force[row] + part * (force[following] - force[row])


@part()
def _after_drive(u: float, e: Record, memory: Record) -> float:
    """The force that is left of u behind dead band, saturation and hysteresis of the drive [N]."""
    if e.dead_band > 0:
        u = u - _clipped(u, e.dead_band)
    if e.saturation > 0:
        u = _clipped(u, LARGEST / (1.0 + e.saturation))
    if e.valve_hysteresis > 0:
        memory.played = min(max(memory.played, u - e.valve_hysteresis), u + e.valve_hysteresis)
        u = memory.played
    return u


@part()
def _forces_of_the_motion(x: float, v: float, t: float, e: Record) -> float:
    """Hidden forces that depend on the present motion alone, without dry friction [N]."""
    force = e.quadratic_drag * v * abs(v) + e.cubic_stiffness * x**3
    force += e.quadratic_stiffness * x * x + e.viscous_by_direction * abs(v)
    force += e.van_der_pol * x * x * v - e.constant_force
    if e.pulsating_spring != 0:
        force += e.pulsating_spring * np.sin(2 * np.pi * 0.7 * t) * x
    force -= e.backlash * _clipped(x, GAP)
    if abs(x) > STOP:
        force += e.hard_stop * (x - np.sign(x) * STOP)
    if e.knocks > 0 and (t % 1.7) < 0.02:
        force -= e.knocks
    return -force


@part()
def _forces_with_memory(v: float, e: Record, memory: Record) -> float:
    """Hidden forces that remember the motion, after a step of it [N]."""
    force = 0.0
    if e.bouc_wen > 0:
        memory.yielded += H * (
            v
            - 0.5 * abs(v) * memory.yielded * abs(memory.yielded) / 0.0025
            - 0.5 * v * memory.yielded**2 / 0.0025
        )
        force -= e.bouc_wen * memory.yielded
    if e.dahl > 0:
        memory.bent += H * 50.0 * v * (1.0 - memory.bent * np.sign(v))
        force -= e.dahl * memory.bent
    if e.maxwell > 0:
        memory.branch += H * (v - 2.0 * memory.branch)
        force -= e.maxwell * memory.branch
    return force


@part()
def _under_friction(v: float, other: float, dry: float) -> tuple[float, float]:
    """Acceleration and velocity after a step under the other forces and dry friction."""
    if dry > 0 and abs(v) * MASS < dry * H and abs(other) <= dry:
        return 0.0, 0.0
    towards = np.sign(v) if v != 0.0 else np.sign(other)
    a = (other - dry * towards) / MASS
    following = v + H * a
    crosses = dry > 0 and v != 0.0 and np.sign(following) != np.sign(v)
    return a, 0.0 if crosses and abs(other) <= dry else following


@kernel()
def _run(
    force: FloatArray, strengths: NDArray[np.void], held: bool, out: FloatArray,
    kept: NDArray[np.void],
) -> None:  # fmt: skip
    """Writes what the sensors read at each sample to `out`, shape (n, 2)."""
    e: Record = strengths[0]
    memory: Record = kept[0]
    x, v, a = 0.0, 0.0, 0.0
    late = round(e.delay / H) if e.delay > 0 else 0
    for k in range(len(force)):
        read_x, read_a = x, 0.0
        for step in range(STEPS):
            u = _drive_force(force, k * STEPS + step - late, held)
            u = _after_drive(u, e, memory)
            now = v + 0.5 * H * a  # v is half a step behind x
            other = u - STIFFNESS * x - DAMPING * now
            other += _forces_of_the_motion(x, now, (k * STEPS + step) * H, e)
            other += _forces_with_memory(v, e, memory)
            dry = e.coulomb
            if e.stribeck != 0:
                dry += e.stribeck * np.exp(-((now / 0.08) ** 2))
            dry += e.end_binding * (x / 0.1) ** 4
            a, v = _under_friction(v, other, dry)
            if step == 0:
                if k == 0:
                    memory.slow_a, memory.slow_x = a, x
                read_a = memory.slow_a if e.acceleration_lag > 0 else a
                read_x = memory.slow_x if e.position_lag > 0 else x
            x += H * v
            if e.position_lag > 0:
                memory.slow_x += (x - memory.slow_x) * -np.expm1(-H / e.position_lag)
            if e.acceleration_lag > 0:
                memory.slow_a += (a - memory.slow_a) * -np.expm1(-H / e.acceleration_lag)
        out[k, 0] = read_x + e.position_offset + e.position_drift * k / RATE
        out[k, 1] = read_a * (1.0 + e.acceleration_gain)
