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
    LASTING,
    LEVELS,
    DecisionRules,
    DecisionState,
)
from monitor.observer.decision.deviation import healthy_variance, late_variance
from monitor.observer.decision.window_statistics import slides, slides_on
from rigwatch.physics.transfer import filter_sample
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

SINGULAR = 1e-9
"""Share of a pivot that must be left for its unknown to be determined."""


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


@part(allocates=True)
def force_of_changed_motion(
    alone: float, since: int, rules: DecisionRules, kept: DecisionState
) -> float:
    """The force that is told once friction has acted throughout a long window [N].

    Friction changes the motion, and what the equations mispredict of the change may look like more
    or less friction. It is a sum of the remainder's terms whose weights differ from those of the
    healthy rig by no more than its recordings leave open: the force is that of dry friction beside
    them, the mean of its distribution given the residual (Bayesian linear regression, C. Bishop,
    Pattern Recognition and Machine Learning, 2006, section 3.3).

    Args:
        alone: force of dry friction alone [N], told where the information is not known.
        since: newest samples in which friction acts.
        rules, kept: as in `decide`.
    """
    count = rules.information.shape[0]
    if count == 0:
        return alone
    first = LEVELS + rules.growth.size
    matrix, target = np.zeros((count + 1, count + 1)), np.zeros(count + 1)
    noise = 1.0 + late_variance(kept) / healthy_variance(kept, rules)
    matrix[:count, :count] = rules.information * noise
    for ago in range(1, min(since, LASTING, kept.counts[FILLED]) + 1):
        if not slides_on(kept, ago):
            continue
        row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
        for i in range(count):
            for j in range(i + 1):
                matrix[i, j] += row[first + i] * row[first + j]
            matrix[count, i] += row[DRY] * row[first + i]
            target[i] += row[first + i] * row[ERROR]
        matrix[count, count] += row[DRY] * row[DRY]
        target[count] += row[DRY] * row[ERROR]
    force = _last_unknown(matrix, target, alone)
    return force if force > 0.0 else alone


@part()
def _last_unknown(matrix: FloatArray, target: FloatArray, otherwise: float) -> float:
    """The last of the unknowns that solve a positive definite system, of which the lower triangle
    is given; its factor and the steps to the solution take their place.

    Args:
        matrix, target: of the system.
        otherwise: what is returned if the system does not determine it.
    """
    last = target.size - 1
    for i in range(last + 1):
        whole = matrix[i, i]
        for j in range(i):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
            matrix[i, i] -= matrix[i, j] ** 2
            target[i] -= matrix[i, j] * target[j]
        if not matrix[i, i] > SINGULAR * whole:
            return otherwise
        matrix[i, i] = np.sqrt(matrix[i, i])
        target[i] /= matrix[i, i]
    return target[last] / matrix[last, last]


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
