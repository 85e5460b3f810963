"""The reference of a drive that does not repeat: how large a healthy residual may be.

There is no period to average. There the residual itself is judged. How much a linear model leaves
grows with the motion, so its variance is taken as n² + r²·am² with am² the modelled acceleration's
mean square of late, r² its share over sixteen stretches of the run, and n² so large that no stretch
lies above it.
"""

import numpy as np
from numba import njit

from monitor.reference.reference_state import (
    APERIODIC,
    ARMED,
    Reference,
    ReferenceRules,
)
from rigwatch.wire.arrays import FloatArray

STRETCHES = 16
"""Stretches of `learn` samples of which an excitation without a period is learnt from."""
APERIODIC_CYCLE = 256
"""Taken for one cycle of the motion where there is none [samples]."""


@njit()
def learn_aperiodic(ref: Reference, rules: ReferenceRules, row: FloatArray) -> None:
    """Σa², Σa·am, Σam², Σx² and ΣV² of each stretch; their number counts one by one."""
    stretch = ref.counts.learnt // rules.learn
    a, am = row[2], row[3]
    ref.sums[0, stretch] += a * a
    ref.sums[1, stretch] += a * am
    ref.sums[2, stretch] += am * am
    ref.sums[3, stretch] += row[1] * row[1]
    ref.products[4] += row[0] * row[0]
    ref.counts.learnt += 1
    if ref.counts.learnt >= STRETCHES * rules.learn:
        _arm_aperiodic(ref, rules.learn)


@njit()
def _arm_aperiodic(ref: Reference, length: int) -> None:
    """Nothing repeats: the residual itself is judged, against what stretches of `length` samples
    left.
    """
    total, learnt = np.zeros(4), ref.counts.learnt
    for i in range(4):
        for k in range(STRETCHES):
            total[i] += ref.sums[i, k]
    aa, am, mm, xx = total
    scale = am / mm if mm > 0.0 else 0.0
    left = aa - 2.0 * scale * am + scale**2 * mm
    share = max(left, 0.0) / max(scale**2 * mm, 1e-30)
    largest = 0.0
    for k in range(STRETCHES):
        moved = scale**2 * ref.sums[2, k]
        left = ref.sums[0, k] - 2.0 * scale * ref.sums[1, k] + moved
        largest = max(largest, (left - share * moved) / length)
    ref.levels.left_share = share
    ref.levels.quick = ref.levels.slow = scale**2 * mm / learnt
    ref.template[:, :] = 0.0
    ref.levels.scale = scale
    ref.levels.noise = max(ref.levels.noise, np.sqrt(largest))
    ref.levels.swing = np.sqrt(ref.products[4] / learnt)
    ref.levels.position_swing = np.sqrt(xx / learnt)
    ref.levels.acceleration_swing = np.sqrt(aa / learnt)
    ref.counts.depth = learnt
    ref.counts.cycle = APERIODIC_CYCLE
    ref.counts.source = APERIODIC
    ref.counts.mode = ARMED


@njit(inline="always")
def follow_level(ref: Reference, modelled: float) -> None:
    """Take in one modelled acceleration, scaled, where there is no period [m/s^2]."""
    ref.levels.quick += (modelled * modelled - ref.levels.quick) / 64.0
    ref.levels.slow += (modelled * modelled - ref.levels.slow) / 512.0
