"""Whether the residual departs from that of a healthy rig at the present motion.

Energies over a short and a medium window, the Coulomb force, small lasting changes, the sensors'
disagreement, the size of the motion and the evidence of the onset of dry friction are each taken
relative to their limit; the deviation is the largest of them.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.observer.decision.decision_state import (
    ABOVE,
    AMPLITUDE,
    DELAYED,
    DEVIATION,
    DEVIATIONS,
    DISAGREE,
    ERROR,
    EVIDENCE,
    FILLED,
    FORCE,
    FOUND_LATE,
    GAP_AGO,
    HEAD,
    HISTORY,
    JUMP_AGO,
    LEVEL,
    LEVELS,
    LONG,
    MEASURED,
    MEDIUM,
    ONSET,
    QUIET,
    READ,
    REST,
    SENSORS,
    SHORT,
    SPREAD,
    UNDECIDED,
    USUAL_FRICTION,
    USUAL_LASTING,
    USUAL_MEDIUM,
    USUAL_ONSET,
    USUAL_SHORT,
    VISCOUS,
    DecisionRules,
    DecisionState,
)
from monitor.observer.decision.window_statistics import (
    friction,
    lasting_energy,
    mean_square,
    onset_evidence,
    rest,
)
from monitor.observer.lateness import (
    is_constant,
    is_late,
    rubs,
    rubs_beside,
    seems_late,
    told_lateness,
    unsure_lateness,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

SURE, SURELY_NEW, REMAINS = 2.0, 1.25, 128
"""Ratio to the limit above which a deviation is a departure at once; the same for a residual that
is compared with what a healthy rig left at this very motion; and samples after which a smaller one
is a departure: transients of a drive change are small or short.
"""


@part()
def deviate(  # noqa: PLR0917 -- a kernel
    k: int,
    usual: FloatArray,
    response: float,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> tuple[float, float, float, float]:
    """Fill the estimates and the deviation of sample `k`.

    Returns:
        What a healthy rig leaves, as a standard deviation; the limit of the medium window's energy;
        and `known` and `onset` of `departs`.
    """
    late = late_variance(kept)
    edges = mean_square(kept, READ, MEDIUM) + mean_square(kept, UNDECIDED, MEDIUM)
    spread = np.sqrt(healthy_variance(kept, rules) + late + edges)
    medium_limit = _energy_limit(rules.medium, usual[USUAL_MEDIUM], rules)
    _estimate(k, spread, rules, kept, out)
    short = mean_square(kept, ERROR, SHORT) / spread**2
    short /= _energy_limit(rules.short, usual[USUAL_SHORT], rules)
    medium = mean_square(kept, ERROR, MEDIUM) / spread**2 / medium_limit
    allowed = _friction_limit(usual[USUAL_FRICTION], rules)
    largest = max(np.sqrt(short), np.sqrt(medium), out[DEVIATIONS, k] / allowed)
    lasting = lasting_energy(kept, spread**2 * usual[USUAL_LASTING] * rules.lasting)
    constant = is_constant(kept.lateness)
    out[EVIDENCE, k] = onset_evidence(kept, spread, unsure_lateness(kept.lateness), constant)
    onset = out[EVIDENCE, k] / (usual[USUAL_ONSET] * np.sqrt(rules.lasting))
    if (late > 0.0 and not constant) or edges > 0.0 or kept.counts[GAP_AGO] < LONG:
        onset = 0.0
    # A motion of another size than under the same drive before: slow evidence, never at once.
    size = min(response, SURE)
    out[DEVIATION, k] = max(largest, np.sqrt(out[SENSORS, k]), np.sqrt(lasting), size, onset)
    known = 0.0 if np.isinf(usual[USUAL_SHORT]) or late + edges > 0.0 else largest
    return spread, medium_limit, known, onset


@part()
def _estimate(
    k: int, spread: float, rules: DecisionRules, kept: DecisionState, out: FloatArray
) -> None:
    """Fill the estimates of sample `k`, and how much the sensors disagree."""
    out[AMPLITUDE, k] = mean_square(kept, LEVEL, MEDIUM)
    out[SPREAD, k], out[FOUND_LATE, k] = spread, told_lateness(kept.lateness)
    out[FORCE, k], out[VISCOUS, k], out[DEVIATIONS, k], _, _ = friction(kept, MEDIUM, spread)
    out[REST, k] = rest(kept, LONG, rules.speed_noise)
    measured = mean_square(kept, MEASURED, MEDIUM)
    sensor_variance = rules.sensor_noise**2 + rules.sensor_growth**2 * measured
    out[SENSORS, k] = mean_square(kept, DISAGREE, MEDIUM) / sensor_variance / rules.sensor


@part()
def departs(deviation: float, known: float, onset: float, kept: DecisionState) -> bool:
    """Whether a deviation is a departure: in an episode any beyond the limit, otherwise one that is
    sure, that lasts, or that a jump of a channel explains.

    Args:
        deviation: the largest, relative to its limit.
        known: that of the residual from the healthy one at this very motion; 0 if that or the
            instants of the inputs are not known.
        onset: evidence of the onset of dry friction, relative to its limit at this very motion; 0
            if that or the instants of the inputs are not known.
        kept: the state.
    """
    count = kept.counts
    away = deviation > 1.0
    count[QUIET] = 0 if away else count[QUIET] + 1
    count[ABOVE] = count[ABOVE] + 1 if away else 0
    if count[ONSET] < 0:
        away = count[ABOVE] >= REMAINS or _sure(deviation, known, onset, kept)
    return away or count[JUMP_AGO] == 0


def friction_limit(usual: FloatArray, rules: DecisionRules) -> FloatArray:
    """Coulomb estimate at which the rig has departed, in standard deviations.

    Args:
        usual: the largest of the healthy rig at the present motion, one or several.
        rules: of the decision.
    """
    known = np.minimum(rules.friction, usual * np.sqrt(rules.lasting))
    return np.where(np.isinf(usual), rules.friction * np.sqrt(rules.unseen), known)


@part()
def _energy_limit(largest: float, usual: float, rules: DecisionRules) -> float:
    """Energy at which the rig has departed, from the largest ever and at the present motion."""
    if np.isinf(usual):
        return largest * rules.unseen
    return min(largest, usual * rules.lasting)


@part()
def _friction_limit(usual: float, rules: DecisionRules) -> float:
    if np.isinf(usual):
        return rules.friction * np.sqrt(rules.unseen)
    return min(rules.friction, usual * np.sqrt(rules.lasting))


@part()
def _sure(deviation: float, known: float, onset: float, kept: DecisionState) -> bool:
    """Whether a deviation is a departure at once.

    Where steps that slide fall is not known of every input, and the lateness jumps by a sample.

    Args:
        deviation, known, onset, kept: as in `departs`.
    """
    if is_late(kept.lateness):
        beside = is_constant(kept.lateness)
        rubbing = rubs_beside(kept.lateness) if beside else rubs(kept.lateness)
        return onset > 1.0 or (kept.counts[ABOVE] >= MEDIUM and rubbing)
    new = known > SURELY_NEW or onset > 1.0
    return deviation > SURE or (new and not seems_late(kept.lateness))


@part()
def late_variance(kept: DecisionState) -> float:
    """Mean square of what the unknown part of the inputs' lateness leaves."""
    return unsure_lateness(kept.lateness) ** 2 * mean_square(kept, DELAYED, MEDIUM)


@part()
def healthy_variance(kept: DecisionState, rules: DecisionRules) -> float:
    """Mean square of what a healthy rig leaves at this motion, the inputs' instants being known."""
    n = min(MEDIUM, kept.counts[FILLED])
    total = rules.noise**2
    for c in range(rules.growth.size):
        level = 0.0
        for ago in range(1, n + 1):
            level += kept.rows[(kept.counts[HEAD] - ago) % HISTORY, LEVELS + c]
        total += rules.growth[c] * level / max(n, 1)
    return total
