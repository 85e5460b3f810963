"""Two tanks, one above the other: a pump fills the upper one, each empties through a hole.

    volume of each tank: dV/dt = in − out,    out = area of the hole · speed of a free jet

The volumes are integrated by Heun's method, 20 steps a sample; levels follow from them.

Symbols: u voltage of the pump [V], h levels [m].
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

RATE = 1.0
"""Samples a second."""
STEPS = 20
GROUND = (0.0028, 0.0032)
"""Base areas of the upper and the lower tank [m^2]."""
HOLES = (7.1e-6, 5.7e-6)
"""Effective areas of their holes [m^2]."""
PUMP = 3.3e-6
"""Flow per volt [m^3/(s V)]."""
FALL = 9.81
RESTING = 4.0
"""Voltage of the initial equilibrium [V]."""
LARGEST = 9.0
"""Voltage at which the pump saturates, divided by 1 + the strength [V]."""
EFFECTS = (
    "leak", "dead_band", "saturation", "inlet", "late_pump", "seep", "level_offset", "slow_level",
)  # fmt: skip
"""Names of the hidden effects, in the order of their strengths."""


@part()
def _jet(level: float) -> float:
    return float(np.sqrt(2 * FALL * max(level, 0.0)))


@part()
def _flows(v1: float, v2: float, flow: float, s: FloatArray) -> tuple[float, float]:
    upper, lower = v1 / GROUND[0], v2 / GROUND[1]
    between = HOLES[0] * _jet(upper)
    up = flow - between - s[0] * _jet(upper) - s[5] * max(upper, 0.0)
    down = between - HOLES[1] * _jet(lower) + s[3]
    return up, down


@kernel()
def run(voltage: FloatArray, s: FloatArray, out: FloatArray, spans: FloatArray) -> None:
    """Levels of both tanks [m] at each sample; the first sample is at rest.

    Args:
        voltage: of the pump, held from sample to sample, shape (n,) [V].
        s: strengths of `EFFECTS`.
        out: levels, shape (n, 2).
        spans: time from each sample to the next, shape (n,) [s].
    """
    v1, v2, shown, flow = 0.0, 0.0, 0.0, 0.0
    resting = round(1500 * RATE)
    for k in range(-resting, len(voltage)):
        h = (spans[k] if k >= 0 else 1.0 / RATE) / STEPS
        if k >= 0:
            out[k, 0] = v1 / GROUND[0] + s[6]
            out[k, 1] = shown if s[7] > 0 else v2 / GROUND[1]
        u = voltage[k] if k >= 0 else RESTING
        if s[1] > 0:
            u -= max(-s[1], min(s[1], u))
        if s[2] > 0:
            u = min(u, LARGEST / (1.0 + s[2]))
        for _ in range(STEPS):
            flow = PUMP * u if s[4] <= 0 else flow + (PUMP * u - flow) * -np.expm1(-h / s[4])
            a1, a2 = _flows(v1, v2, flow, s)
            b1, b2 = _flows(v1 + h * a1, v2 + h * a2, flow, s)
            v1, v2 = max(v1 + h * (a1 + b1) / 2, 0.0), max(v2 + h * (a2 + b2) / 2, 0.0)
            if s[7] > 0:
                shown += (v2 / GROUND[1] - shown) * -np.expm1(-h / s[7])


def drive(seed: int, samples: int = 2400) -> FloatArray:
    """Voltage of the pump: random steps, sometimes off, shape (samples,) [V]."""
    random = np.random.default_rng(seed)
    found = np.full(samples, RESTING)
    at = round(30 * RATE)
    while at < samples:
        stays = round(RATE * random.uniform(15, 90))
        found[at : at + stays] = random.choice([0.0, random.uniform(1, 8)], p=[0.1, 0.9])
        at += stays
    return found
