"""Two tanks, one above the other, with a sensor in the lower one only.

    A·w·dw/dt = g·(in − a·w),    w = √(2·g·h),    out = a·w

The state is the speed w of the jet that leaves a tank. The implicit midpoint rule makes each step a
quadratic equation with one root that is not negative, so a tank may run dry. 40 steps a sample.

Symbols: u voltage of the pump [V], h levels [m], w speeds of the jets [m/s].
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

RATE = 0.25
"""Samples a second."""
STEPS = 40
GROUND = (0.0031, 0.0026)
"""Base areas of the upper and the lower tank [m^2]."""
HOLES = (6.4e-6, 7.7e-6)
"""Effective areas of their holes [m^2]."""
PUMP = 3.0e-6
"""Flow per volt [m^3/(s V)]."""
FALL = 9.81
RESTING = 3.0
"""Voltage of the initial equilibrium [V]."""
LARGEST = 8.0
"""Voltage at which the pump saturates, divided by 1 + the strength [V]."""
RIM = 0.2
"""Level of the upper tank above which it spills over [m]."""
EFFECTS = ("dead_band", "saturation", "inlet", "late_pump", "slow_level", "spill")
"""Names of the hidden effects, in the order of their strengths.

Half of what spills over falls into the lower tank, as no single effect of the library describes.
"""


@part()
def _emptied(w: float, flow: float, tank: int, h: float) -> float:
    """Speed of a tank's jet after a step."""
    fall = FALL * h / GROUND[tank]
    braked = fall * HOLES[tank]
    rest = w * w + 2.0 * fall * flow - braked * w
    return float(np.sqrt(0.25 * braked * braked + max(rest, 0.0)) - 0.5 * braked)


@kernel()
def run(voltage: FloatArray, s: FloatArray, out: FloatArray, spans: FloatArray) -> None:
    """Level of the lower tank [m] at each sample; the first sample is at rest.

    Args:
        voltage: of the pump, held from sample to sample, shape (n,) [V].
        s: strengths of `EFFECTS`.
        out: level, shape (n, 1).
        spans: time from each sample to the next, shape (n,) [s].
    """
    w1, w2, shown, flow = 0.0, 0.0, 0.0, 0.0
    resting = round(1500 * RATE)
    for k in range(-resting, len(voltage)):
        h = (spans[k] if k >= 0 else 1.0 / RATE) / STEPS
        level = w2 * w2 / (2.0 * FALL)
        if k >= 0:
            out[k, 0] = shown if s[4] > 0 else level
        u = voltage[k] if k >= 0 else RESTING
        if s[0] > 0:
            u -= max(-s[0], min(s[0], u))
        if s[1] > 0:
            u = min(u, LARGEST / (1.0 + s[1]))
        for _ in range(STEPS):
            flow = PUMP * u if s[3] <= 0 else flow + (PUMP * u - flow) * -np.expm1(-h / s[3])
            spilt = s[5] * max(w1 * w1 / (2.0 * FALL) - RIM, 0.0)
            before = w1
            w1 = _emptied(w1, flow - spilt, 0, h)
            between = 0.5 * HOLES[0] * (before + w1)
            w2 = _emptied(w2, between + 0.5 * spilt + s[2], 1, h)
            if s[4] > 0:
                shown += (w2 * w2 / (2.0 * FALL) - shown) * -np.expm1(-h / s[4])


def drive(seed: int, samples: int = 600) -> FloatArray:
    """Voltage of the pump: slow sines that begin at rest, shape (samples,) [V]."""
    random = np.random.default_rng(seed)
    time = np.arange(samples) / RATE
    sizes, lines = random.uniform(0.3, 1.1, 8), random.uniform(1 / 900, 1 / 120, 8)
    angles = 2 * np.pi * np.outer(time, lines) + random.uniform(0, 2 * np.pi, 8)
    begins = np.clip((time - 30) / 60, 0.0, 1.0)
    return np.asarray(np.clip(RESTING + begins * (np.sin(angles) @ sizes), 0.0, 9.0))
