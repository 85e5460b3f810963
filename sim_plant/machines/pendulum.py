"""A pendulum on a geared servo, driven by a held voltage; an encoder measures its angle.

    J·dw/dt = K/R·(V − K·w) − b·w − G·sin(a) − hidden,    da/dt = w

K includes the gear ratio; the current follows without delay. Angle and speed alternate (leapfrog),
with true sticking. With play in the gear the motor is a separate body, in contact with the arm
through a stiff spring with damping. 40 steps a sample.

Symbols: V voltage [V], a angle [rad], w speed [rad/s].
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel
from sim_plant.machines.dry_friction import slid

RATE = 100.0
"""Samples a second."""
STEPS = 40
RESISTANCE, CONSTANT = 4.0, 0.5
"""[ohm], [V s], gear included."""
INERTIA, DAMPING, GRAVITY = 0.012, 0.01, 0.6
"""[kg m^2], [N m s], [N m] at a right angle."""
MOTOR_SHARE = 0.3
"""Share of the inertia in the motor, with play."""
TEETH = 60.0
"""Contact stiffness of the teeth [N m/rad]."""
LARGEST = 3.2
"""Voltage at which the amplifier clips, divided by 1 + the strength [V]."""
EFFECTS = (
    "coulomb", "stribeck", "air_drag", "imbalance", "gear_play", "dead_band", "saturation",
    "late_drive", "cable", "stop", "encoder_offset",
)  # fmt: skip
"""Names of the hidden effects, in the order of their strengths."""
STOP = 0.8
"""Angle at which a rubber stop begins [rad]."""


@kernel()
def run(voltage: FloatArray, s: FloatArray, out: FloatArray, spans: FloatArray) -> None:
    """Angle [rad] at each sample.

    Args:
        voltage: commanded, held from sample to sample, shape (n,) [V].
        s: strengths of `EFFECTS`.
        out: angle, shape (n, 1).
        spans: time from each sample to the next, shape (n,) [s].
    """
    a, w, motor, turning = 0.0, 0.0, 0.0, 0.0
    late = round(s[7] * RATE * STEPS) if s[7] > 0 else 0
    for k in range(len(voltage)):
        h = spans[k] / STEPS
        out[k, 0] = a + s[10]
        for step in range(STEPS):
            u = voltage[max(k * STEPS + step - late, 0) // STEPS]
            if s[5] > 0:
                u -= max(-s[5], min(s[5], u))
            if s[6] > 0:
                limit = LARGEST / (1.0 + s[6])
                u = max(-limit, min(limit, u))
            load = -GRAVITY * np.sin(a) - DAMPING * w - s[2] * w * abs(w) + s[3]
            load -= s[8] * a**3
            if abs(a) > STOP:
                load -= s[9] * (a - np.sign(a) * STOP)
            dry = s[0] + s[1] * np.exp(-((w / 0.6) ** 2))
            if s[4] > 0:
                gap = motor - a
                pressed = gap - max(-s[4], min(s[4], gap))
                touch = TEETH * pressed + (0.02 * (turning - w) if pressed != 0.0 else 0.0)
                turning += (
                    h
                    * (CONSTANT * (u - CONSTANT * turning) / RESISTANCE - touch)
                    / (MOTOR_SHARE * INERTIA)
                )
                motor += h * turning
                w = slid(w, load + touch, dry, (1.0 - MOTOR_SHARE) * INERTIA, h)
            else:
                pushed = CONSTANT * (u - CONSTANT * w) / RESISTANCE
                w = slid(w, load + pushed, dry, INERTIA, h)
            a += h * w


def drive(seed: int, samples: int = 2400) -> FloatArray:
    """Voltage of random steps on a slow oscillation, shape (samples,) [V]."""
    random = np.random.default_rng(seed)
    found = np.zeros(samples)
    at = round(0.3 * RATE)
    while at < samples:
        stays = round(RATE * random.uniform(0.1, 0.9))
        found[at : at + stays] = random.uniform(-3.2, 3.2)
        at += stays
    return found
