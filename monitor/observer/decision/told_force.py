"""The force with which dry friction is told [N]."""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.observer.decision.decision_state import (
    BARE,
    DRY,
    ERROR,
    FILLED,
    HEAD,
    HISTORY,
    LEVEL,
    LONG,
    WET,
    DecisionState,
)
from monitor.observer.decision.deviation import late_variance
from monitor.observer.decision.window_statistics import (
    RIDGE,
    slides,
    slides_on,
    solved,
)
from rigwatch.physics.transfer import filter_sample
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

PUSHES = 2.0
"""Standard deviations by which dry friction beside what is mispredicted of the changed motion
exceeds dry friction alone, above which the latter acts as negative damping.
"""
OFTEN = 3
"""Reversals in the longest window that tell dry friction from what is mispredicted."""


@part()
def dry_force(
    kept: DecisionState, surely: int, length: int, high_pass: FloatArray
) -> tuple[float, float]:
    """Force of dry friction alone [N], over a window and over the part of it in which it acts.

    A steady motion hardly distinguishes viscous friction from it, and a joint fit would assign to
    viscous friction what smoothing and presliding round off. Friction is noticed a little after it
    begins: of the instants at which it may have begun, the second force is of that from which on
    friction explains most energy (a change point by maximum likelihood). Samples from before would
    make it appear smaller.
    Over a whole window the sample before a reversal counts: the high-passed force is largest there,
    and without it strong friction appears a tenth smaller.

    Args:
        kept: the window's rows.
        surely: newest samples in which friction acts, if it does.
        length: of the window [samples].
        high_pass: of the judged signals, see `DecisionRules`.
    """
    n = min(length, kept.counts[FILLED])
    a = p = 0.0
    for ago in range(1, n + 1):
        if slides(kept, ago):
            row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
            a += row[DRY] * row[DRY]
            p += row[DRY] * row[ERROR]
    whole = p / a if a > 0.0 else 0.0
    if surely >= n:
        return whole, whole
    most = acting = 0.0
    for start in range(surely, n + 1):
        force, explained = _force_since(kept, start, high_pass)
        if force > 0.0 and explained > most:
            most, acting = explained, force
    return whole, acting


@part()
def force_of_changed_motion(alone: float, spread: float, turns: int, kept: DecisionState) -> float:
    """The force that is told once friction has acted throughout the longest window [N].

    Friction changes the motion, and what the equations mispredict of the change is like damping, of
    either sign, and like mass. Negative damping, which no friction is, makes dry friction alone
    appear smaller: then the force beside both is told. Positive damping may as well be what
    smoothing and presliding round off. Only reversals tell dry friction from either. What is not
    known of the inputs' lateness repeats with the motion, and at worst all of it looks like the
    difference.

    Args:
        alone: force of dry friction alone [N].
        spread: what a healthy rig leaves, as a standard deviation.
        turns: reversals in the longest window.
        kept: the state.
    """
    if turns < OFTEN:
        return alone
    beside, left, used = _beside_change(kept, LONG)
    unsure = PUSHES * spread + np.sqrt(used * late_variance(kept))
    return beside if (beside - alone) * np.sqrt(left) > unsure else alone


@part()
def _beside_change(kept: DecisionState, length: int) -> tuple[float, float, int]:
    """Force of dry friction beside what is mispredicted of the motion that it has changed [N], what
    determines it, and the number of samples that count.

    To first order that is a combination of viscous friction and of the predicted acceleration, as
    friction mostly changes size and phase of the motion.

    Args:
        kept: the window's rows.
        length: of the window [samples].
    """
    used = 0
    a = b = c = p = q = d = f = h = r = yy = 0.0
    for ago in range(1, min(length, kept.counts[FILLED]) + 1):
        if not slides_on(kept, ago):
            continue
        row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
        dry, wet, moved, error = row[DRY], row[WET], row[LEVEL], row[ERROR]
        used += 1
        a += dry * dry
        b += dry * wet
        c += wet * wet
        p += dry * error
        q += wet * error
        d += dry * moved
        f += wet * moved
        h += moved * moved
        r += moved * error
        yy += error * error
    if h <= 0.0:
        return 0.0, 0.0, 0
    h *= 1.0 + RIDGE
    products = a - d * d / h, b - d * f / h, c - f * f / h
    force, _, left, _, _ = solved(*products, p - d * r / h, q - f * r / h, yy, 0.0)
    return force, left, used


@part(allocates=True)
def _force_since(kept: DecisionState, start: int, high_pass: FloatArray) -> tuple[float, float]:
    """Force of dry friction that begins with the sample `start` ago [N], and what it explains.

    A high-passed force that reverses is twice the step with which one begins that was not there:
    compared with the response to friction that has always acted, friction that has just begun
    would appear half as large until the high-pass has forgotten, and its beginning earlier than it
    is.
    """
    a = p = 0.0
    state = np.zeros(high_pass.shape[1] - 1)
    for ago in range(start, 0, -1):
        row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
        unit = filter_sample(high_pass[0], high_pass[1], state, row[BARE])
        if slides_on(kept, ago):
            a += unit * unit
            p += unit * row[ERROR]
    return (p / a, p * p / a) if a > 0.0 else (0.0, 0.0)
