"""Adds to a verdict how much of the error remains and which other effects were accepted.

Where the noise floor is the quietest band of the residual, an effect that explains only a little
leaves most of the missing physics in it, and is not named as the answer.
"""

from collections.abc import Sequence

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import EXPLAINED, Ranked, left_over

LITTLE = 1 / 3
"""Share of the energy above the quiet band that the missing effect must explain; one of three
equal effects explains that much."""
LITTLE_IN_TRAINING = LITTLE / 2
"""The same of the training, which excites a missing effect about as much as what is held out."""
MENTIONED = 3
"""Number of further accepted effects that are listed."""


def explains(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether it explains the error above the floor, ignoring samples at its discontinuities."""
    return left_over(base, row, floor, tolerant=True) <= 1 - EXPLAINED


def explains_little(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether most of the error is caused by something else.

    The quietest band is a lower limit of the noise, so more of the error may remain above it.
    """
    if floor.method != "quiet band":
        return not explains(base, row, floor)
    return left_over(base, row, floor, tolerant=True) > 1 - LITTLE


def hardly_trains(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether it leaves nearly all of the training error above the quiet band.

    Near the noise a few percent of the error held out are most of what is above it, and an effect
    may lower it by that much by accident.
    """
    assert row.fitted is not None
    after = row.fitted.train
    if floor.method != "quiet band" or floor.reached(after):
        return False
    return floor.left_over(base.train, after) > 1 - LITTLE_IN_TRAINING


def remaining_error(base: Fitted, row: Ranked, floor: NoiseFloor) -> str:
    """The error that an effect leaves above the floor, in words; empty at the noise floor."""
    assert row.fitted is not None
    if floor.reached(row.fitted.held_out) or explains(base, row, floor):
        return ""
    share = left_over(base, row, floor)
    times = floor.ratio(row.fitted.held_out)
    return f"; {share:.0%} of the error's energy remains, {times:.2g} times the noise floor"


def other_accepted(rows: Sequence[Ranked], named: Sequence[str]) -> str:
    """The best accepted effects that are not named, in words; empty if there are none."""
    others = [row for row in rows if row.accepted and row.label not in named]
    best = sorted(others, key=lambda row: row.held_out_error)[:MENTIONED]
    listed = ", ".join(f"{row.label} ({row.fitted.told_error:.3g})" for row in best if row.fitted)
    more = f" and {len(others) - len(best)} more" if len(others) > len(best) else ""
    return f"; also accepted: {listed}{more}" if listed else ""
