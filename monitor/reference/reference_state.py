"""What the healthy reference carries from sample to sample, and the names of its places."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray

SETTLING, LEARNING, ARMED, RESUMING = 0, 1, 2, 3
NO_REFERENCE, FROM_MODEL, FROM_RUN, APERIODIC, FIXED = 0, 1, 2, 3, 4

MODE, SOURCE, SINCE, PERIOD, ANCHOR, LEARNT, RING_FILL, RING_HEAD, DEPTH, CYCLE = range(10)
"""Integers of the state: mode, where the reference is from, samples since the last restart, period
[samples], sample number of its first place, samples learnt, fill and head of the voltage ring,
periods averaged, one to and fro of the mass [samples].
"""
SCALE, NOISE, POSITION_NOISE, VOLTAGE_NOISE, SWING, POSITION_SWING, ACCELERATION_SWING = range(7)
LEFT_SHARE, QUICK, SLOW = range(7, 10)
"""Floats: amplitude scale; noise of y, x, V; rms of the periodic part of V, x, a. Without a period:
r²; mean square of the modelled acceleration, quick to follow and slow to forget [(m/s^2)^2].
"""

LONGEST_AVERAGE = 512
"""Periods after which the reference is complete."""


class Reference(NamedTuple):
    """State. Templates and sums have one row a signal (V, x, a, am) and one column a place in the
    period.
    """

    number: NDArray[np.int64]
    value: FloatArray
    template: FloatArray
    sums: FloatArray
    products: FloatArray
    ring: FloatArray
    known: FloatArray
    known_period: NDArray[np.int64]
    known_scale: FloatArray
    known_depth: NDArray[np.int64]


class ReferenceRules(NamedTuple):
    """What arming goes by; see `DecisionSection` and `NoiseSection` for units."""

    settle: int
    learn: int
    longest_period: int
    residual_noise: float
    position_noise: float
    voltage_noise: float
    fixed: bool


def new_reference(rules: ReferenceRules, known: list[tuple[FloatArray, float, int]]) -> Reference:
    """A state that knows the model file's references: ((4, P) signals, scale, periods averaged)."""
    longest = max([rules.longest_period, *[signals.shape[1] for signals, _, _ in known]])
    stored = np.zeros((len(known), 4, longest))
    for place, (signals, _, _) in enumerate(known):
        stored[place, :, : signals.shape[1]] = signals
    number, value = np.zeros(10, np.int64), np.zeros(10)
    value[SCALE] = 1.0
    return Reference(
        number,
        value,
        np.zeros((4, longest)),
        np.zeros((4, longest)),
        np.zeros(6),
        np.zeros(2 * rules.longest_period),
        stored,
        np.array([signals.shape[1] for signals, _, _ in known], np.int64),
        np.array([scale for _, scale, _ in known], np.float64),
        np.array([depth for _, _, depth in known], np.int64),
    )
