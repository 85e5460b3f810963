"""Threshold factors, derived from one allowed probability of a false alarm.

A healthy deviation D² of two estimates follows χ² with two degrees of freedom, so
P(D > k) = exp(-k²/2) per test. With one test per sample, n tests a year and an allowed probability
P of any false alarm in a year,

    k = √( 2·ln(n·g/P) ),   g = 3 statistics tested together.

Successive tests share samples, so fewer are independent: counting every test is conservative. The
energies over m samples follow χ² with m degrees of freedom and get the same probability.
"""

import numpy as np
from scipy.special import chdtri

from monitor.decision.kernel_state import Rules
from monitor.model import RigModel

SECONDS_A_YEAR = 365.25 * 86400.0
STATISTICS = 3
POSITION_FLOOR, VOLTAGE_FLOOR = 0.02, 0.03
"""Allowed rms drift of a channel from the healthy period, as a share of its amplitude: the daily
influence of temperature on supply and valve.
"""


def chance_a_look(false_alarm: float, sample_rate: float) -> float:
    """Allowed false-alarm probability per test, from that per year."""
    return false_alarm / (SECONDS_A_YEAR * sample_rate * STATISTICS)


def rules_for(model: RigModel) -> Rules:
    """The kernel's decision rules."""
    decision = model.decision
    chance = chance_a_look(decision.false_alarm, model.sample_rate)
    low, high = (model.band.low, model.band.high) if model.band else ((0.0, 0.0), (0.0, 0.0))
    return Rules(
        window=model.window.length,
        hop=model.window.hop,
        factor=float(np.sqrt(-2.0 * np.log(chance))),
        limit_8=float(chdtri(8, chance)),
        limit_64=float(chdtri(64, chance)),
        least_velocity=decision.least_velocity,
        worst_condition=decision.worst_condition,
        position_floor=POSITION_FLOOR,
        voltage_floor=VOLTAGE_FLOOR,
        low1=low[0],
        high1=high[0],
        low2=low[1],
        high2=high[1],
    )
