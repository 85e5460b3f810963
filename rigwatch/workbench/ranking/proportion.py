"""In what proportion motion and acceleration are read, and which gain of a sensor that denies.

A gain of the sensor that drives a model along its measured motion resembles drag or a spring in the
predicted output. But it also changes the rate of change of the measured rate against the output
that measures this balance, which no force does: both sensors show the same motion. Compared with
the healthy recording, the proportion is known to some tenths of a percent.
"""

from typing import NamedTuple

import numpy as np

from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray

BLOCKS, LEAST = 16, 512
"""Parts of a recording of which the spread is taken, and samples from which it is."""
ALIKE = 0.3
"""Largest rms of what differs between the two readings, over that of one, of the same motion."""
SURE, ROUGH = 3.0, 0.01
"""Deviation of a proportion in standard deviations, and by what smoothing may change it."""
SEEN = 0.5
"""Share of a gain that must be seen in the proportion."""


class Proportion(NamedTuple):
    """Rate of the measured rate over the output that measures it, and its standard deviation."""

    value: float
    deviation: float


def proportion(recording: Recording, rate: int) -> Proportion | None:
    """The proportion of a recording; None if its first output does not measure the same motion.

    Args:
        recording: along the measured motion.
        rate: column of the rate among its inputs.
    """
    ends = np.cumsum(recording.parts or (len(recording),))[:-1]
    parts = np.split(recording.inputs[:, rate], ends)
    derived = np.concatenate([np.gradient(part) for part in parts]) / recording.spacing
    measured = recording.outputs[:, 0]
    valid = np.isfinite(measured)
    if int(valid.sum()) < LEAST:
        return None
    x, y = derived[valid], measured[valid] - measured[valid].mean()
    value = _ratio(x, y)
    left = float(np.std(x - value * y))
    if not left <= ALIKE * float(np.std(x)):
        return None
    pieces = zip(np.array_split(x, BLOCKS), np.array_split(y, BLOCKS), strict=True)
    spread = float(np.std([_ratio(*piece) for piece in pieces], ddof=1))
    return Proportion(value, spread / np.sqrt(BLOCKS))


def _ratio(derived: FloatArray, measured: FloatArray) -> float:
    return float(derived @ measured) / max(float(measured @ measured), 1e-300)


def denies_gain(healthy: Recording, test: Recording, rate: int, gain: float) -> str:
    """Why a gain of the motion's sensor cannot be what is missing; empty if it can.

    Args:
        healthy, test: recordings along the measured motion.
        rate: column of the rate among their inputs.
        gain: reading over true motion.
    """
    before, after = proportion(healthy, rate), proportion(test, rate)
    if before is None or after is None or not min(before.value, after.value, gain) > 0.0:
        return ""
    changed = float(np.log(after.value / before.value))
    relative = [each.deviation / each.value for each in (before, after)]
    unsure = ROUGH + SURE * float(np.linalg.norm(relative))
    expected = float(np.log(gain))
    if abs(expected - changed) <= max(unsure, (1.0 - SEEN) * abs(expected)):
        return ""
    return (
        f"the motion's sensor and that of its balance read in {np.exp(changed):.3f} times the"
        f" proportion of the healthy rig, which a gain of {gain:.3g} here would change"
    )
