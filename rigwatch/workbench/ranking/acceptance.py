"""Decides from the held-out recordings whether an effect is accepted.

The held-out error must fall by more than chance and by a material amount. Where a single event
shows an effect, as a stop that is hit once, there are no blocks whose signs could tell chance:
there it must halve the error of the training and that of the held-out recordings. The training fit
must show that the effect's strength differs from zero: by its interval, or by the training error
without the effect where it vanishes with its strength. The interval follows the slopes at the fit,
which vanish where a strength saturates, as the resistance of a drive that limits its current hard
does, and may then reach back to zero (W. W. Hauck, A. Donner, Journal of the American Statistical
Association 72, 1977). An effect can vanish, so a fit that is worse in training than the one without
it has ended in a local minimum, and what it does to the held-out recordings says nothing.
"""

from functools import cache

import sympy

from rigwatch.physics.engine.equations import Effect, Placement, names_in, parse, symbol
from rigwatch.physics.engine.fit import Fit
from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.fit import Fitted, interval_with_held
from rigwatch.workbench.ranking.paired_test import Difference, difference
from rigwatch.workbench.ranking.ranked import Ranked

MATERIAL = 0.03
"""Smallest relative fall of the held-out error that justifies an effect."""
STEP = 0.025
"""One-sided level at which the held-out error must fall."""
HALVED = 0.5
"""Fall of the error, in training and held out alike, that is no chance however few blocks show it:
the strength and the instant of an event that training did not see are predicted."""
EXPLAINED = 0.95
"""Share of the energy above the floor that an effect must explain to account for the error."""

NEAR = 2.0
"""Ratio of error to floor above which something remains to be explained in any case."""


def judge_fit(base: Fitted, row: Ranked) -> None:
    """Accept the row if its held-out error falls by more than chance and its strength is nonzero.

    Sets the row's `gain`, `accepted`, `reason` and `vague`.
    """
    assert row.fitted is not None
    found = difference(base.held_out, row.fitted.held_out)
    trained = 1 - row.fitted.train_error / max(base.train_error, 1e-300)
    row.gain, row.reason, row.vague = found.mean, _refused(found, trained), False
    if row.fitted.train_error > (1 + MATERIAL) * base.train_error:
        row.reason = "its fit ended in a local minimum: the training error rises"
    if not row.reason and (vague := _undetermined_strength(base, row)) is not None:
        row.reason, row.vague = vague, True
    row.accepted = not row.reason
    row.reason = row.reason or "held-out error falls"


def _refused(found: Difference, trained: float) -> str:
    """Why the held-out error does not support an effect; empty if it does.

    Args:
        found: fall of the held-out error.
        trained: relative fall of the training error.
    """
    if found.mean <= 0:
        more = "" if found.p_rises < STEP else ", no more than by chance"
        return f"held-out error rises{more}"
    if found.p_falls >= STEP and min(found.relative, trained) < HALVED:
        return "held-out error falls no more than by chance"
    return "" if found.relative > MATERIAL else f"held-out error falls by less than {MATERIAL:.0%}"


def _undetermined_strength(base: Fitted, row: Ranked) -> str | None:
    """Reason if the training leaves the strength's neutral value possible, otherwise None."""
    assert row.fitted is not None
    found = neutral_strength(row.fitted.train, row.placement)
    if found is None or refutes_neutral(base.train, row.fitted.train, row.placement.effect):
        return None
    return f"the training does not determine its strength: {found}"


def refutes_neutral(without: Fit, found: Fit, effect: Effect) -> bool:
    """Whether the training speaks against an effect's neutral strength, whatever its interval.

    At its neutral strength an effect of which nothing is left then is the model without it. The
    sign test of the blocks is stricter than the fit's gain by its own parameters: those of two gain
    as much by chance in one of 2000 recordings.

    Args:
        without: the same model fitted without the effect.
        found: the fit with it.
        effect: the effect.
    """
    if not vanishes(effect):
        return False
    fall = difference(without, found)
    return fall.p_falls < STEP and fall.relative > MATERIAL


def vanishes(effect: Effect) -> bool:
    """Whether nothing of the effect is left at its neutral strength."""
    neutral = effect.parameters[effect.strength].neutral
    left = _names_at_neutral(effect.expression, effect.strength, neutral)
    return left.isdisjoint({*effect.parameters, *effect.states})


def neutral_strength(found: Fit, placement: Placement) -> str | None:
    """An effect's strength with its interval, if that contains the neutral value; otherwise None.

    Shape parameters that vanish with the effect are held: a strength correlated with them alone is
    imprecise, but not neutral.
    """
    effect, prefix = placement.effect, placement.prefix
    name = effect.strength
    shape = [prefix + other for other in vanishing_shape(effect)]
    interval = interval_with_held(found, prefix + name, shape)
    p = effect.parameters[name]
    if p.role == "switch" or interval is None or not interval[0] <= p.neutral <= interval[1]:
        return None
    return f"{name} = {interval[0]:.3g} … {interval[1]:.3g}"


def vanishing_shape(effect: Effect) -> list[str]:
    """Parameters that vanish from the expression when the strength is neutral."""
    neutral = effect.parameters[effect.strength].neutral
    left = {effect.strength, *_names_at_neutral(effect.expression, effect.strength, neutral)}
    return [name for name in effect.parameters if name not in left]


@cache
def _names_at_neutral(expression: str, strength: str, neutral: float) -> frozenset[str]:
    """Names left in an expression when its strength is neutral."""
    names = {name: symbol(name) for name in names_in(expression, "effect")}
    value = sympy.nsimplify(neutral)
    rest = parse(expression, names, "effect").subs(symbol(strength), value)
    return frozenset(each.name for each in rest.free_symbols)


def left_over(base: Fitted, row: Ranked, floor: NoiseFloor, *, tolerant: bool = False) -> float:
    """Share of the error above the floor that a row leaves, ignoring its discontinuities.

    If `tolerant`, an error at the noise floor counts as zero, and so does the model's own error.
    """
    assert row.fitted is not None
    before, after = base.held_out, row.fitted.held_out
    left = floor.left_over(before, after, row.fitted.calm, tolerant=tolerant)
    return min(left, floor.beyond_own_error(before, after, row.fitted.calm)) if tolerant else left


def leaves_nothing(row: Ranked, base: Fitted, floor: NoiseFloor) -> bool:
    """Whether it explains so much of the error above the floor that only similar effects could."""
    assert row.fitted is not None
    near = floor.ratio(row.fitted.held_out, row.fitted.calm) < NEAR
    return near and left_over(base, row, floor) < 1 - EXPLAINED
