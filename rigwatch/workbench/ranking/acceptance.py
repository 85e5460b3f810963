"""Whether an effect counts: the recordings held out decide.

Their error must fall by more than chance would do, and by enough to be worth it; and the recordings
that are fitted must tell that the effect is there at all.
"""

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.fit import Fitted, Value, values
from rigwatch.workbench.ranking.paired_test import Difference, difference
from rigwatch.workbench.ranking.ranked import Ranked

MATERIAL = 0.03
"""Share by which the held-out error must fall at least to be worth an effect."""
STEP = 0.025
"""One-sided level at which the held-out error must fall."""
EXPLAINED = 0.95
"""Share of the energy above the floor that an effect must explain for the error to be known."""

NEAR = 2.0
"""Error over the floor beyond which something is left to explain, however much there was."""


def judge_fit(base: Fitted, row: Ranked) -> None:
    """Say whether the held-out error falls by more than chance, with a strength that is told."""
    assert row.fitted is not None
    found = difference(base.held_out, row.fitted.held_out)
    row.gain, row.reason = found.mean, _refused(found)
    if not row.reason and (vague := _vague(row)) is not None:
        row.reason = vague
    row.accepted = not row.reason
    row.reason = row.reason or "held-out error falls"


def _refused(found: Difference) -> str:
    """Why the recordings held out do not speak for an effect, empty where they do."""
    if found.mean <= 0:
        more = "" if found.p_rises < STEP else ", no more than by chance"
        return f"held-out error rises{more}"
    if found.p_falls >= STEP:
        return "held-out error falls no more than by chance"
    return "" if found.relative > MATERIAL else f"held-out error falls by less than {MATERIAL:.0%}"


def _vague(row: Ranked) -> str | None:
    """What says that the effect may as well be absent, None where its strength is told."""
    assert row.fitted is not None
    name = row.placement.effect.strength
    p, value = row.placement.effect.parameters[name], _strength(row)
    if p.role == "switch" or value is None or value.interval is None:
        return None
    low, high = value.interval
    if not low <= p.neutral <= high:
        return None
    return f"the training does not tell its strength: {name} = {low:.3g} … {high:.3g}"


def _strength(row: Ranked) -> Value | None:
    assert row.fitted is not None
    return values(row.fitted.train).get(row.placement.prefix + row.placement.effect.strength)


def left_over(base: Fitted, row: Ranked, floor: NoiseFloor, *, tolerant: bool = False) -> float:
    """Share of the error above the floor that a row leaves, but for samples at which it jumps."""
    assert row.fitted is not None
    before, after = base.held_out, row.fitted.held_out
    return floor.left_over(before, after, row.fitted.calm, tolerant=tolerant)


def leaves_nothing(row: Ranked, base: Fitted, floor: NoiseFloor) -> bool:
    """Whether it explains so much of the error above the floor that only its like could as well."""
    assert row.fitted is not None
    near = floor.ratio(row.fitted.held_out, row.fitted.calm) < NEAR
    return near and left_over(base, row, floor) < 1 - EXPLAINED
