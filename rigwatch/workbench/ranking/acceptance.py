"""Whether an effect counts: the recordings held out decide.

Their error must fall, block by block, by more than chance would do, and by enough to be worth it.
"""

import numpy as np
from scipy.stats import t as student

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.fit import Fitted, block_errors
from rigwatch.workbench.ranking.ranked import Ranked

MATERIAL = 0.03
"""Share by which the held-out error must fall at least to be worth an effect."""
STEP = 0.025
"""One-sided level at which the held-out error must fall."""
EXPLAINED = 0.95
"""Share of the energy above the floor that an effect must explain for the error to be known."""


def judge_fit(base: Fitted, row: Ranked) -> None:
    """Say whether the held-out error falls by more than chance."""
    assert row.fitted is not None
    row.gain, row.gain_deviation = gain(base, row.fitted)
    count = len(block_errors(base.held_out))
    needed = student.ppf(1 - STEP, count - 1) * row.gain_deviation
    fall = 1 - row.held_out_error / base.held_out_error
    row.accepted = bool(row.gain > max(needed, 0.0) and fall > MATERIAL)
    row.reason = _said(row.gain, needed, row.accepted)


def _said(gained: float, needed: float, accepted: bool) -> str:
    if accepted:
        return "held-out error falls"
    if gained <= 0:
        return "held-out error rises"
    if gained <= needed:
        return "held-out error falls no more than by chance"
    return f"held-out error falls by less than {MATERIAL:.0%}"


def gain(base: Fitted, other: Fitted) -> tuple[float, float]:
    """Fall of the held-out mean squared error from `base` to `other`, and its deviation."""
    difference = block_errors(base.held_out) - block_errors(other.held_out)
    return float(difference.mean()), float(difference.std(ddof=1) / np.sqrt(len(difference)))


def left_over(base: Fitted, row: Ranked, floor: NoiseFloor, *, tolerant: bool = False) -> float:
    """Share of the error above the floor that a row leaves, but for samples at which it jumps."""
    assert row.fitted is not None
    before, after = base.held_out, row.fitted.held_out
    return floor.left_over(before, after, row.fitted.calm, tolerant=tolerant)


def leaves_nothing(row: Ranked, base: Fitted, floor: NoiseFloor) -> bool:
    """Whether it explains so much of the error above the floor that only its like could as well."""
    return left_over(base, row, floor) < 1 - EXPLAINED
