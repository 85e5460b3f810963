"""Adds to a verdict how much of the error remains and which other effects were accepted.

Where the noise floor is the quietest band of the residual, an effect that explains only a little
leaves most of the missing physics in it, and is not named as the answer.
"""

from collections.abc import Sequence

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import EXPLAINED, NEAR, Ranked, left_over

LITTLE = 1 / 3
"""Share of the energy above the quiet band that the missing effect must explain; one of three
equal effects explains that much."""
LITTLE_BESIDE = 1 / 2
"""The same of training and held-out recordings alike where the model has an effect already: one of
two that are left explains that much."""
LITTLE_IN_TRAINING = LITTLE / 2
"""The same of the training, which excites a missing effect about as much as what is held out."""
AGAIN = "explain again once it is added"
GOES_ELSEWHERE = (
    "what is held out shows more than the training does: exchange [[train]] and [[held_out]] in the"
    " study's file, or give each a part of every recording"
)
MENTIONED = 3
"""Number of further accepted effects that are listed."""


def explains(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether it explains the error above the floor, ignoring samples at its discontinuities."""
    return left_over(base, row, floor, tolerant=True) <= 1 - EXPLAINED


def explains_little(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether most of the error is caused by something else.

    The quietest band is a lower limit of the noise, so more of the error may remain above it.
    """
    if not floor.lower_limit:
        return not explains(base, row, floor)
    if left_over(base, row, floor, tolerant=True) > 1 - LITTLE:
        return True
    assert row.fitted is not None
    train = floor.of_training.left_over(base.train, row.fitted.train)
    left = min(left_over(base, row, floor), train)
    return bool(base.placements) and left > 1 - LITTLE_BESIDE


def hardly_trains(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether it leaves nearly all of the training error above the quiet band.

    Near the noise a few percent of the error held out are most of what is above it, and an effect
    may lower it by that much by accident.
    """
    assert row.fitted is not None
    after, floor = row.fitted.train, floor.of_training
    if not floor.lower_limit or floor.reached(after):
        return False
    return floor.left_over(base.train, after) > 1 - LITTLE_IN_TRAINING


def remaining_share(base: Fitted, row: Ranked, floor: NoiseFloor) -> float:
    """Share of the error's energy above the floor that an effect leaves, held out or in training.

    Returns:
        The larger of both; 0 if it explains both errors.
    """
    return max(_remaining_held_out(base, row, floor), _remaining_in_training(base, row, floor))


def shows_little_of_it(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether an effect explains the held-out error, but not that of the training.

    The held-out recordings then move the machine so that what else is missing hardly shows, or
    looks like the effect.
    """
    held_out = _remaining_held_out(base, row, floor)
    return not held_out and _remaining_in_training(base, row, floor) > 0.0


def remaining_error(base: Fitted, row: Ranked, floor: NoiseFloor) -> str:
    """`remaining_share` in words, and of which error; empty near the noise floor."""
    assert row.fitted is not None
    held_out = _remaining_held_out(base, row, floor)
    train = _remaining_in_training(base, row, floor)
    share, of, fitted = held_out, "error", row.fitted.held_out
    if train > held_out:
        share, of, fitted, floor = train, "training error", row.fitted.train, floor.of_training
    times = floor.times(fitted)
    if share > 1.0:
        return f"; it raises the {of} to {times:.2g} times the noise floor"
    if share:
        told = f"; {share:.0%} of the {of}'s energy remains, {times:.2g} times the noise floor"
        only = not train and held_out > LITTLE and _trains(base, floor.of_training)
        return told + (f", but next to nothing of the training's; {GOES_ELSEWHERE}" if only else "")
    above = floor.own_error is None and floor.ratio(fitted) > NEAR
    return f"; what is left is {times:.2g} times the noise floor: {AGAIN}" if above else ""


def _remaining_held_out(base: Fitted, row: Ranked, floor: NoiseFloor) -> float:
    assert row.fitted is not None
    if floor.reached(row.fitted.held_out) or explains(base, row, floor):
        return 0.0
    return left_over(base, row, floor)


def _remaining_in_training(base: Fitted, row: Ranked, floor: NoiseFloor) -> float:
    """The same of the training."""
    assert row.fitted is not None
    floor = floor.of_training
    if not _trains(base, floor) or floor.reached(row.fitted.train):
        return 0.0
    share = floor.left_over(base.train, row.fitted.train)
    return share if share > 1 - EXPLAINED else 0.0


def _trains(base: Fitted, floor: NoiseFloor) -> bool:
    """Whether the training's error is above its floor, and told by that."""
    return floor.method != "healthy motion" and not floor.reached(base.train)


def other_accepted(rows: Sequence[Ranked], named: Sequence[str]) -> str:
    """The best accepted effects that are not named, in words; empty if there are none."""
    others = [row for row in rows if row.accepted and row.label not in named]
    best = sorted(others, key=lambda row: row.held_out_error)[:MENTIONED]
    listed = ", ".join(f"{row.label} ({row.fitted.told_error:.3g})" for row in best if row.fitted)
    more = f" and {len(others) - len(best)} more" if len(others) > len(best) else ""
    return f"; also accepted: {listed}{more}" if listed else ""
