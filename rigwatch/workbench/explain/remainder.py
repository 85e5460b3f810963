"""What a verdict leaves unsaid otherwise: how much stays, and what else was accepted.

Where the floor is the quietest band of the residual, an effect that helps a little leaves the most
of what is missing, and is not called the answer.
"""

from collections.abc import Sequence

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import EXPLAINED, Ranked, left_over

LITTLE = 1 / 3
"""Share of the energy above the quiet band that an effect must explain to be what is missing: the
largest of three equal ones does."""
MENTIONED = 3
"""Effects that are accepted as well, and named."""


def explains(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether it explains the error above the floor, but for samples at which it jumps."""
    return left_over(base, row, floor, tolerant=True) <= 1 - EXPLAINED


def explains_too_little(base: Fitted, row: Ranked, floor: NoiseFloor) -> bool:
    """Whether what is missing is mostly something else.

    The quietest band is a lower limit of the noise, so that more may stay above it.
    """
    if floor.method != "quiet band":
        return not explains(base, row, floor)
    return left_over(base, row, floor, tolerant=True) > 1 - LITTLE


def what_stays(base: Fitted, row: Ranked, floor: NoiseFloor) -> str:
    """How much an effect leaves above the floor; empty where that is nothing but noise."""
    assert row.fitted is not None
    if floor.reached(row.fitted.held_out) or explains(base, row, floor):
        return ""
    share = left_over(base, row, floor)
    times = floor.ratio(row.fitted.held_out)
    return f"; {share:.0%} of the error's energy stays, {times:.2g} times the noise floor"


def accepted_as_well(rows: Sequence[Ranked], named: Sequence[str]) -> str:
    """The best of what lowers the held-out error and is not named; empty where there is none."""
    others = [row for row in rows if row.accepted and row.label not in named]
    best = sorted(others, key=lambda row: row.held_out_error)[:MENTIONED]
    said = ", ".join(f"{row.label} ({row.held_out_error:.3g})" for row in best)
    more = f" and {len(others) - len(best)} more" if len(others) > len(best) else ""
    return f"; accepted as well: {said}{more}" if said else ""
