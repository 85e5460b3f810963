"""Limits on a verdict for a rough model, and for any model along its measured motion.

A model learned from a healthy rig is valid along the motions it was trained on. A fault changes the
motion, so part of the residual is model error. Therefore:

* residual no larger than on the healthy rig: nothing is missing, even if an effect lowers it;
* residual slightly larger: an effect that fits it is not named, for a model of equations unless it
  explains all of a rest that is larger than at the noise floor;
* best effect leaves much more than the model's own error along this motion: another effect acts in
  addition to it or in its place, and it is not named with confidence, for any model;
* best effect leaves more than the healthy residual: a nearly equal one may be the right one, as
  the model error may favour either.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.explain.indistinguishable import NEARLY
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import MUCH_WORSE, Ranked

MOTION_ALLOWANCE = 1.2
"""Ratio of the error to the healthy error that a changed motion alone can cause.

Healthy rigs of the simulated family leave 1.07 to 1.3 times as much under another excitation.
"""
REST = 0.12
"""Share of a slightly larger residual's energy above the healthy one that an effect may leave.

A supply pressure that differs by 2 % leaves 1.17 times the healthy error, of which a gain explains
all but 0.19; right effects leave up to 0.08 of such a rest by chance.
"""
SHARE = 0.03
"""Share of the squared error beyond the model's own that a single effect may leave.

On rigs of two makes that nobody here had tuned to, effects that were named correctly leave 0.1 to
2.6 % of it; one of two hidden effects, or a law about another middle, leaves 4 to 18 %.
"""
SHARE_ALONE = 0.06
"""The same where no second effect explains what it leaves, for a model of equations.

Dry friction of rigs whose pressures the model describes less well in a changed motion leaves 3.4 to
4.0 %, of which the best second effect still leaves 78 to 89 %. Of two hidden effects, and of what
stands for a spring, the second one leaves 0.3 to 36 %.
"""
REMAINS = 0.6
"""Share of what one effect leaves that every second one leaves at least, if it acts alone."""
MUCH = 1.5
"""Ratio of the error to the healthy error beyond which one effect is not the full explanation.

For recordings too short for the model's own error by frequency. On the rigs examined, a single
effect that was named correctly leaves up to 1.3 times the healthy error and 1.3 % of the square
above it; one of two hidden effects leaves 2.0 times and 6 %.
"""


def much_left(base: Fitted, floor: NoiseFloor, fitted: Fitted, most: float = SHARE) -> bool:
    """Whether the residual is so large that the fitted effects cannot be all that is missing.

    Samples at an effect's discontinuities do not count, see `discontinuities.py`, nor does the
    model's own error along this motion, see `error_spectrum.py`. Of the error beyond that a share
    of `most` may be left.
    """
    if floor.own_error is not None:
        return _beyond_own(base, floor, fitted) > most
    left, before = (floor.ratio(fit, fitted.calm) for fit in (fitted.held_out, base.held_out))
    return left > MUCH and left**2 - 1 > SHARE * (before**2 - 1)


def leaves_much(base: Fitted, floor: NoiseFloor, found: Verdict) -> bool:
    """Whether the single effect named leaves so much that another must act as well."""
    if found.word != "missing_effect" or found.second or found.best is None:
        return False
    fitted = found.best.fitted
    return fitted is not None and much_left(base, floor, fitted, _allowed(found))


def _allowed(found: Verdict) -> float:
    """Share of the error beyond the model's own that the effect named may leave."""
    return SHARE_ALONE if found.alone else SHARE


def _beyond_own(base: Fitted, floor: NoiseFloor, fitted: Fitted) -> float:
    """Share of the error beyond the model's own that a fit leaves."""
    return floor.beyond_own_error(base.held_out, fitted.held_out, fitted.calm)


def acts_alone(base: Fitted, floor: NoiseFloor, found: Verdict, beside: Sequence[Fitted]) -> bool:
    """Whether what the single effect named leaves remains with every second effect.

    Args:
        base, floor, found: as in `leaves_much`.
        beside: fits with pairs of effects, the most promising ones.
    """
    best = found.best.fitted if found.word == "missing_effect" and found.best else None
    if best is None or not beside or floor.own_error is None:
        return False
    least = min(_beyond_own(base, floor, one) for one in beside)
    return least > REMAINS * _beyond_own(base, floor, best)


def leaves_some(base: Fitted, floor: NoiseFloor, found: Verdict) -> bool:
    """Whether the single effect named leaves a share above the floor that another may explain.

    Where noise is most of the floor, as mains hum, the ratio of the error to it hides that share.
    By frequency nothing is hidden, and `leaves_much` has judged it, but of a large error that share
    is small even where far more than the healthy error is left.
    """
    if found.word != "missing_effect" or found.second or found.best is None:
        return False
    fitted = found.best.fitted
    if fitted is None:
        return False
    ratio = floor.ratio(fitted.held_out, fitted.calm)
    if floor.own_error is not None:
        return ratio > MUCH
    if ratio <= floor.allowed:
        return False
    return floor.left_over(base.held_out, fitted.held_out, fitted.calm) > SHARE


def undetermined_if_little_and_unexplained(
    base: Fitted, floor: NoiseFloor, found: Verdict
) -> Verdict:
    """The verdict, made undetermined if a changed motion alone may have caused the residual.

    Args:
        base: the current model, of equations.
        floor: the model's residual on the healthy recording.
        found: the verdict on the ranking.
    """
    best = found.best.fitted if found.best is not None else None
    if found.word != "missing_effect" or best is None or floor.method != "healthy motion":
        return found
    little = floor.ratio(base.held_out) <= MOTION_ALLOWANCE
    explained = floor.left_over(base.held_out, best.held_out) <= REST
    if not little or (explained and not floor.reached(base.held_out)):
        return found
    assert found.best is not None
    return replace(found, word="undetermined", text=_changed_motion(base, floor, found.best))


def _changed_motion(base: Fitted, floor: NoiseFloor, best: Ranked) -> str:
    return (
        f"the held-out error is {floor.ratio(base.held_out):.2f} times that on the healthy"
        f" recording, which a changed motion alone can cause; {best.label} would also explain it"
    )


def undetermined_if_much_left(base: Fitted, floor: NoiseFloor, found: Verdict) -> Verdict:
    """The verdict, made undetermined if the single effect named leaves a large residual."""
    if not leaves_much(base, floor, found):
        return _with_rest_told(base, floor, found)
    assert found.best is not None
    assert found.best.fitted is not None
    fitted = found.best.fitted
    if floor.own_error is None:
        left = floor.ratio(fitted.held_out)
        healthy = floor.method in {"healthy", "healthy motion"}
        of = "error on the healthy recording" if healthy else "noise floor"
        told = f"{left:.2f} times the {of}, expected at most {MUCH:g}"
    else:
        share, most = _beyond_own(base, floor, fitted), _allowed(found)
        told = f"{share:.1%} of the error beyond the model's own, expected at most {most:.0%}"
    text = f"{found.best.label} explains most, but leaves {told}: another effect may act as well"
    return replace(found, word="undetermined", text=text)


def _with_rest_told(base: Fitted, floor: NoiseFloor, found: Verdict) -> Verdict:
    """The verdict; what an effect leaves is told where more is allowed as it acts alone."""
    fitted = found.best.fitted if found.alone and found.best else None
    if fitted is None or not much_left(base, floor, fitted):
        return found
    told = f"it leaves {_beyond_own(base, floor, fitted):.0%} of the error beyond the model's own"
    return replace(found, text=f"{found.text}; {told}, and no second effect explains that")


def limited_verdict(
    base: Fitted, rows: Sequence[Ranked], floor: NoiseFloor, found: Verdict
) -> Verdict:
    """The verdict, weakened to what a rough model can support.

    Args:
        base: the current model.
        rows: the ranking.
        floor: the model's residual on the healthy recording.
        found: the verdict on the ranking.
    """
    ratio = floor.ratio(base.held_out)
    if floor.reached(base.held_out):
        text = f"the held-out error is {ratio:.2f} times that on the healthy recording"
        return Verdict("nothing_missing", None, (), (), text, evidence=found.evidence)
    if found.word != "missing_effect" or found.best is None:
        return found
    if ratio <= MOTION_ALLOWANCE:
        text = _changed_motion(base, floor, found.best)
        return replace(found, word="undetermined", text=text)
    if leaves_much(base, floor, found):
        return undetermined_if_much_left(base, floor, found)
    rivals = _nearly_as_good(rows, floor, found)
    if not rivals:
        return found
    text = f"{found.best.label} explains most, and {', '.join(rivals)} nearly as much"
    return replace(found, word="undetermined", rivals=rivals, text=text)


def _nearly_as_good(rows: Sequence[Ranked], floor: NoiseFloor, found: Verdict) -> tuple[str, ...]:
    """Effects of other physics nearly as good as a best one that leaves more than a healthy rig."""
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
