"""A DC motor on a bench, driven by a held voltage; a tachometer measures its speed.

    L·di/dt = V − R·i − K·w,    J·dw/dt = K·i − b·w − hidden

The current takes the exact step of its linear equation at constant speed and voltage; then speed
takes an explicit step, with true sticking. 40 steps a sample.

Symbols: V voltage [V], i current [A], w speed [rad/s], a angle [rad].
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel
from sim_plant.machines.dry_friction import slid

RATE = 200.0
"""Samples a second."""
STEPS = 40
RESISTANCE, INDUCTANCE, CONSTANT = 2.0, 0.012, 0.06
"""[ohm], [H], [V s]."""
INERTIA, DAMPING = 2.5e-4, 6e-5
"""[kg m^2], [N m s]."""
LARGEST = 14.0
"""Voltage at which the amplifier clips, divided by 1 + the strength [V]."""
EFFECTS = (
    "coulomb", "stribeck", "fan", "load", "cogging", "drag_by_direction", "dead_band",
    "saturation", "tacho_lag", "amplifier_asymmetry",
)  # fmt: skip
"""Names of the hidden effects, in the order of their strengths."""


@kernel()
def run(voltage: FloatArray, s: FloatArray, out: FloatArray, spans: FloatArray) -> None:
    """Speed [rad/s] at each sample.

    Args:
        voltage: commanded, held from sample to sample, shape (n,) [V].
        s: strengths of `EFFECTS`.
        out: speed, shape (n, 1).
        spans: time from each sample to the next, shape (n,) [s].
    """
    i, w, a, shown = 0.0, 0.0, 0.0, 0.0
    for k in range(len(voltage)):
        h = spans[k] / STEPS
        fade = np.exp(-h * RESISTANCE / INDUCTANCE)
        out[k, 0] = shown if s[8] > 0 else w
        u = voltage[k]
        if s[6] > 0:
            u -= max(-s[6], min(s[6], u))
        if s[7] > 0:
            limit = LARGEST / (1.0 + s[7])
            u = max(-limit, min(limit, u))
        u += s[9] * abs(u)
        for _ in range(STEPS):
            steady = (u - CONSTANT * w) / RESISTANCE
            i = steady + (i - steady) * fade
            torque = CONSTANT * i - DAMPING * w
            torque -= s[2] * w * abs(w) + s[3] + s[5] * abs(w)
            torque += s[4] * np.sin(7.0 * a)
            dry = s[0] + s[1] * np.exp(-((w / 12.0) ** 2))
            w = slid(w, torque, dry, INERTIA, h)
            a += h * w
            if s[8] > 0:
                shown += (w - shown) * -np.expm1(-h / s[8])


def drive(seed: int, samples: int = 2400) -> FloatArray:
    """Voltage of a bench test: random steps of both signs and zero, shape (samples,) [V]."""
    random = np.random.default_rng(seed)
    found = np.zeros(samples)
    at = round(0.25 * RATE)
    while at < samples:
        stays = round(RATE * random.uniform(0.08, 0.6))
        found[at : at + stays] = random.choice([0.0, random.uniform(-12, 12)], p=[0.1, 0.9])
        at += stays
    return found
