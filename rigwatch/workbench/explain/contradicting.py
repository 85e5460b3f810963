"""Effects that other evidence speaks for than the recordings held out, where much is left.

Where several effects are missing, the few recordings held out may favour another than the training,
and the fit of the right one may fail. What leads is then not named with confidence.
"""

from collections.abc import Sequence

import numpy as np

from rigwatch.workbench.data import NoiseFloor
from rigwatch.workbench.explain.remaining_error import LITTLE, explains, shows_little_of_it
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking import MATERIAL, Ranked, difference, error_ratio, same_family

CONTRADICTED = 2.0
"""Ratio of the training energy explained by another effect above which the best is in doubt."""
FAVOURED = 1.25
"""The same where what is held out cannot tell the two apart, and the best leaves much of both."""
HALF = 0.5
"""Share of the training's energy left above which one that explains more of it is a rival."""
REFUTED = 5e-3
"""p-value of a rise of the held-out error below which it tells an effect from the best; eight
blocks of one sign, the fewest of the test, reach it."""


def explaining_training(base: Fitted, best: Ranked, rows: Sequence[Ranked]) -> tuple[str, ...]:
    """Labels of effects that lower both errors and explain far more of the training than the best.

    Training and held-out recordings then disagree on what is missing, as where several effects are
    and one of them happens to matter in the recordings held out.
    """
    assert best.fitted is not None
    least = CONTRADICTED * max(_explained(base, best.fitted), 0.0)
    return tuple(
        row.label
        for row in rows
        if row is not best
        and row.fitted is not None
        and row.held_out_error < base.held_out_error
        and _explained(base, row.fitted) > least
    )


def explaining_all(
    base: Fitted,
    best: Ranked,
    members: Sequence[str],
    rows: Sequence[Ranked],
    floor: NoiseFloor,
) -> tuple[str, ...]:
    """Labels of accepted effects, no less simple, that leave less of all recordings than the best.

    While much remains, held out or in training, that one effect leads on the few recordings held
    out and another on all of them is chance: what is missing beside them may favour either.
    Members of the best's class, and those that lead on both and are passed over for a simpler
    effect, are no such rivals.
    """
    assert best.fitted is not None
    if not others_may_favour(base, best, floor):
        return ()
    return tuple(
        row.label
        for row in rows
        if row is not best
        and row.accepted
        and row.fitted is not None
        and row.free <= best.free
        and error_ratio(best, row) >= 1.0
        and row.label not in members
        and not same_family(best, row)
        and leaves_less_of_all(row.fitted, best.fitted)
    )


def others_may_favour(base: Fitted, best: Ranked, floor: NoiseFloor) -> bool:
    """Whether an effect leaves so much, held out or in training, that the rest may favour it."""
    assert best.fitted is not None
    if floor.reached(best.fitted.held_out):
        return False
    return not explains(base, best, floor) or shows_little_of_it(base, best, floor)


def favoured_by_training(
    base: Fitted, best: Ranked, rows: Sequence[Ranked], floor: NoiseFloor
) -> tuple[str, ...]:
    """Labels of effects that explain more of the training than the best.

    Asked where the best leaves much: what moves the held-out recordings is then also something
    else, which may favour a wrong effect there. Where it leaves half of the training, these are
    accepted effects; one with more parameters must explain clearly more, as each further parameter
    explains some. Where it leaves a third of both errors they need not be accepted, as the rest may
    raise the error of the right effect, but must be as simple, or lead on what is held out too and
    be passed over for their parameters, and explain clearly more; and what is held out must not
    speak for the best far beyond chance: many effects are compared.
    """
    assert best.fitted is not None
    after = best.fitted
    if floor.reached(after.held_out):
        return ()
    held_out, train = (
        floor.left_over(*side)
        for side in ((base.held_out, after.held_out), (base.train, after.train))
    )
    gain = max(_explained(base, after), 0.0)

    def favoured(row: Ranked) -> bool:
        fitted = row.fitted
        if fitted is None or fitted.train_error > (1 - MATERIAL) * base.train_error:
            return False
        more, simple = _explained(base, fitted), row.free <= best.free
        if row.accepted and train > HALF and more > (1.0 if simple else FAVOURED) * gain:
            return True
        clear = (simple or leads_held_out(best, row)) and more > FAVOURED * gain
        much = clear and min(held_out, train) >= LITTLE
        return much and difference(after.held_out, fitted.held_out).p_rises >= REFUTED

    return tuple(row.label for row in rows if _is_another(best, row) and favoured(row))


def leads_held_out(best: Ranked, row: Ranked) -> bool:
    """Whether an accepted effect leaves less of what is held out than the one named for it."""
    return row.accepted and row.fitted is not None and error_ratio(best, row) < 1.0


def not_refuted(
    base: Fitted, best: Ranked, rows: Sequence[Ranked], floor: NoiseFloor
) -> tuple[str, ...]:
    """Labels of effects that resemble the residual more than the best does, and whose fits failed.

    An effect can vanish. A fit that leaves more of the training than there is without the effect
    has ended in a local minimum and tells nothing of it, no more than one that diverged: while the
    best leaves much, the score that put the other before it is all that is known.
    """
    assert best.fitted is not None
    if floor.reached(best.fitted.held_out) or explains(base, best, floor):
        return ()
    risen = (1 + MATERIAL) * base.train_error
    return tuple(
        row.label
        for row in rows
        if _is_another(best, row)
        and row.explained > best.explained
        and (row.unfittable or (row.fitted is not None and row.fitted.train_error > risen))
    )


def _explained(base: Fitted, fitted: Fitted) -> float:
    """Training energy per sample that a fit with an effect explains; negative if it leaves more."""
    return base.train_error**2 - fitted.train_error**2


def _is_another(best: Ranked, row: Ranked) -> bool:
    """Whether it is an effect of other physics, not the best in other words or in more detail."""
    finer = row.port == best.port and row.placement.effect.refines == best.effect
    return not (row is best or finer or row.label in best.alike or same_family(best, row))


def leaves_less_of_all(one: Fitted, other: Fitted) -> bool:
    """Whether a fit leaves less than another of all recordings, training and held out.

    By the sum of the scaled squares of the residuals at samples that count for both.
    """
    left = np.zeros(2)
    for fits in ((one.train, other.train), (one.held_out, other.held_out)):
        squares = [np.square(fit.residuals / fit.scale).ravel() for fit in fits]
        counted = np.isfinite(squares).all(axis=0)
        left += [float(np.sum(each[counted])) for each in squares]
    return bool(left[0] < left[1])
