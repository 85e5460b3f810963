"""State of the healthy reference."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray

SETTLING, LEARNING, ARMED, RESUMING = 0, 1, 2, 3
NO_REFERENCE, FROM_MODEL, FROM_RUN, APERIODIC, FIXED = 0, 1, 2, 3, 4
STRETCHES = 16
"""Number of stretches of `learn` samples that give the reference of an aperiodic excitation."""

_COUNTS = np.dtype(
    [
        ("mode", np.int64),
        ("source", np.int64),  # origin of the reference
        ("since", np.int64),  # samples since the last restart
        ("period", np.int64),  # [samples]
        ("anchor", np.int64),  # sample number of the period's first place
        ("learnt", np.int64),  # samples
        ("unlearnt", np.int64),  # samples missing since the learning began
        ("ring_fill", np.int64),  # of the ring of voltages
        ("ring_head", np.int64),
        ("ring_missing", np.int64),  # samples of the ring that are missing
        ("depth", np.int64),  # periods averaged
        ("refined", np.int64),  # samples of the next one
        ("cycle", np.int64),  # one to and fro of the mass [samples]
    ]
)
_LEVELS = np.dtype(
    [
        ("scale", np.float64),  # amplitude scale
        ("noise", np.float64),  # of the residual's change y
        ("position_noise", np.float64),
        ("voltage_noise", np.float64),
        ("swing", np.float64),  # rms of the periodic part of the voltage
        ("position_swing", np.float64),
        ("acceleration_swing", np.float64),
        # Without a period:
        ("left_share", np.float64),  # r²
        ("quick", np.float64),  # mean square of the modelled acceleration, quick to follow
        ("slow", np.float64),  # the same, with a long time constant [(m/s^2)^2]
    ]
)

LONGEST_AVERAGE = 512
"""Number of periods after which the reference is complete."""


def new_record(layout: np.dtype[Any]) -> Any:
    """A record of named numbers, initially zero, for compiled functions."""
    return np.zeros(1, layout).view(np.recarray)[0]


class Reference(NamedTuple):
    """State; `counts` and `levels` are records of named numbers.

    Templates and sums have one row per signal (V, x, a, am) and one column per place in the period;
    `seen` counts the samples of each place. The ring of voltages has NaN where one is missing.
    """

    counts: Any
    levels: Any
    template: FloatArray
    sums: FloatArray
    seen: NDArray[np.int64]
    products: FloatArray
    ring: FloatArray
    known: FloatArray
    known_period: NDArray[np.int64]
    known_scale: FloatArray
    known_depth: NDArray[np.int64]


class ReferenceRules(NamedTuple):
    """Rules for arming; see `DecisionSection` and `NoiseSection` for units."""

    settle: int
    learn: int
    longest_period: int
    residual_noise: float
    position_noise: float
    voltage_noise: float
    fixed: bool


def new_reference(rules: ReferenceRules, known: list[tuple[FloatArray, float, int]]) -> Reference:
    """Initial state with the model file's references: ((4, P) signals, scale, periods averaged)."""
    lengths = [signals.shape[1] for signals, _, _ in known]
    longest = max(rules.longest_period, STRETCHES, *lengths)
    stored = np.zeros((len(known), 4, longest))
    for place, (signals, _, _) in enumerate(known):
        stored[place, :, : signals.shape[1]] = signals
    counts, levels = new_record(_COUNTS), new_record(_LEVELS)
    levels.scale = 1.0
    return Reference(
        counts,
        levels,
        np.zeros((4, longest)),
        np.zeros((4, longest)),
        np.zeros(longest, np.int64),
        np.zeros(6),
        np.zeros(2 * rules.longest_period),
        stored,
        np.array([signals.shape[1] for signals, _, _ in known], np.int64),
        np.array([scale for _, scale, _ in known], np.float64),
        np.array([depth for _, _, depth in known], np.int64),
    )
