"""The reference of an aperiodic drive: the largest healthy residual.

Without a period there is no average, and the residual itself is judged. The error of a linear model
grows with the motion, so its variance is modelled as n² + r²·am², with am² the recent mean square
of the modelled acceleration, r² the ratio over sixteen stretches of the run, and n² large enough
that no stretch exceeds it.
"""

import numpy as np

from monitor.reference.reference_state import (
    APERIODIC,
    ARMED,
    STRETCHES,
    Reference,
)
from monitor.signals import fill_rows
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

APERIODIC_CYCLE = 256
"""Assumed cycle of the motion for an aperiodic drive [samples]."""


@part()
def learn_aperiodic(ref: Reference, length: int, row: FloatArray) -> None:
    """Accumulate Σa², Σa·am, Σam², Σx² and ΣV² of each stretch; one sample per call."""
    stretch = ref.counts.learnt // length
    a, am = row[2], row[3]
    ref.sums[0, stretch] += a * a
    ref.sums[1, stretch] += a * am
    ref.sums[2, stretch] += am * am
    ref.sums[3, stretch] += row[1] * row[1]
    ref.products[4] += row[0] * row[0]
    ref.counts.learnt += 1


@part(allocates=True)
def arm_aperiodic(ref: Reference, length: int) -> None:
    """Arm for an aperiodic drive; limits come from stretches of `length` samples."""
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
    fill_rows(ref.template, 0.0)
    ref.levels.scale = scale
    ref.levels.noise = max(ref.levels.noise, np.sqrt(largest))
    ref.levels.swing = np.sqrt(ref.products[4] / learnt)
    ref.levels.position_swing = np.sqrt(xx / learnt)
    ref.levels.acceleration_swing = np.sqrt(aa / learnt)
    ref.counts.depth = learnt
    ref.counts.cycle = APERIODIC_CYCLE
    ref.counts.source = APERIODIC
    ref.counts.mode = ARMED


@part(inline="always")
def follow_level(ref: Reference, modelled: float) -> None:
    """Update the level with one scaled modelled acceleration [m/s^2], for aperiodic drives."""
    ref.levels.quick += (modelled * modelled - ref.levels.quick) / 64.0
    ref.levels.slow += (modelled * modelled - ref.levels.slow) / 512.0
