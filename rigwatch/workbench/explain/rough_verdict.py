"""What a verdict on a model along its measured motion may claim, and on a rough one.

A model that has learned what a healthy rig does knows it along the motions that it was shown. A
fault changes the motion, and a little of what is left then is the model's own. So

* where no more is left than on the healthy rig, nothing is missing, whatever would fit that better;
* where hardly more is left, an effect that fits it is not named;
* where the best effect leaves much more than the healthy rig does, another effect hides beside it
  or in its place, and it is not named with confidence, whatever the model;
* where the best effect leaves more than the healthy rig does, another one that does nearly as well
  may be the right one: the model's own error may favour either.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.explain.verdict import MUCH_WORSE, NEARLY, Verdict
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import Ranked

TRANSFERS = 1.2
"""Error over the healthy one up to which another motion may be all that is behind it.

Healthy rigs of the simulated family leave 1.07 to 1.3 times as much under another excitation.
"""
MUCH, SHARE = 1.5, 0.03
"""Error over the healthy one, and share of the squared error above it, from which one effect alone
is not the whole truth.

A rough model's own error grows with the motion, and a strong fault changes the motion: what is
rightly named alone leaves up to 1.3 times the healthy error and 1.3 % on the rigs looked at, one
of two hidden effects 2.0 times and 6 %.
"""


def much_left(base: Fitted, floor: NoiseFloor, fitted: Fitted) -> bool:
    """Whether a fit leaves so much that what it holds cannot be all that is missing.

    Samples at which an effect jumps do not count, see `discontinuities.py`.
    """
    left, before = (floor.ratio(fit, fitted.calm) for fit in (fitted.held_out, base.held_out))
    return left > MUCH and left**2 - 1 > SHARE * (before**2 - 1)


def leaves_much(base: Fitted, floor: NoiseFloor, found: Verdict) -> bool:
    """Whether the effect that is named alone leaves so much that another must hide beside it."""
    if found.word != "missing_effect" or found.second or found.best is None:
        return False
    return found.best.fitted is not None and much_left(base, floor, found.best.fitted)


def not_alone(base: Fitted, floor: NoiseFloor, found: Verdict) -> Verdict:
    """The verdict, with no confidence in one effect that leaves much."""
    if not leaves_much(base, floor, found):
        return found
    assert found.best is not None
    assert found.best.fitted is not None
    left = floor.ratio(found.best.fitted.held_out)
    text = (
        f"{found.best.label} explains most, but leaves {left:.2f} times the error on the"
        f" healthy recording, expected at most {MUCH:g}: something else may hide beside it"
    )
    return replace(found, word="undetermined", text=text)


def modest(base: Fitted, rows: Sequence[Ranked], floor: NoiseFloor, found: Verdict) -> Verdict:
    """The verdict with no more claimed than a rough model can know.

    Args:
        base: the model as it is.
        rows: the ranking.
        floor: what the model leaves of the healthy recording.
        found: the verdict on the ranking.
    """
    ratio = floor.ratio(base.held_out)
    if floor.reached(base.held_out):
        text = f"the held-out error is {ratio:.2f} times that on the healthy recording"
        return Verdict("nothing_missing", None, (), (), text, evidence=found.evidence)
    if found.word != "missing_effect" or found.best is None:
        return found
    if ratio <= TRANSFERS:
        text = (
            f"the held-out error is {ratio:.2f} times that on the healthy recording; as much may"
            f" be the model's own under another motion; {found.best.label} would explain it"
        )
        return replace(found, word="undetermined", text=text)
    if leaves_much(base, floor, found):
        return not_alone(base, floor, found)
    rivals = _nearly_as_good(rows, floor, found)
    if not rivals:
        return found
    text = f"{found.best.label} explains most, and {', '.join(rivals)} nearly as much"
    return replace(found, word="undetermined", rivals=rivals, text=text)


def _nearly_as_good(rows: Sequence[Ranked], floor: NoiseFloor, found: Verdict) -> tuple[str, ...]:
    """Effects of other physics that may be right where the best leaves more than a healthy rig."""
    best = found.best
    assert best is not None
    assert best.fitted is not None
    if floor.reached(best.fitted.held_out) or not best.gain or found.second:
        return ()
    family = best.placement.effect.family
    return tuple(
        row.label
        for row in rows
        if row.accepted
        and row.label not in found.members
        and not (family and row.placement.effect.family == family and row.port == best.port)
        and row.gain is not None
        and row.gain > NEARLY * best.gain
        and row.held_out_error < MUCH_WORSE * best.held_out_error
        and row.free <= best.free
    )
