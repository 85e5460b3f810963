"""Per-sample decision of the observer: estimates, departure, episode and verdict.

    e ─▶ energies of a short and a medium window ─┐
    e, g ─▶ Coulomb and viscous force (window) ───┼▶ departure ─▶ episode ─▶ verdict
    e, g ─▶ evidence of the onset of dry friction ┤
    two views of the measured output ─────────────┘

Energies are relative to the healthy variance n² + κ·A, with A mean squares and fourth powers of the
motion and of the prediction, since the equations' error grows with the motion. A departure is
friction if, since its onset, dry friction explains the residual, the motion has reversed, and the
sensors agree with each other.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np
from numpy.typing import NDArray

from monitor.drives import (
    corrected,
    edges_unsure,
    follow_edges,
    follow_instants,
    still_unsure,
    undecided,
)
from monitor.observer.decision_state import (
    AMPLITUDE,
    ARMING,
    BARE,
    BEYOND,
    DELAYED,
    DEPARTED,
    DEVIATION,
    DEVIATIONS,
    DISAGREE,
    DRY_SHARE,
    ERROR,
    EVIDENCE,
    FORCE,
    FOUND_LATE,
    FRICTION,
    HISTORY,
    JUDGING,
    LEVEL,
    LEVELS,
    LONG,
    MEASURED,
    MEDIUM,
    MODE,
    NAMED_FORCE,
    OTHER,
    READ,
    REST,
    SENSORS,
    SHARE,
    SHORT,
    SPEED,
    SPREAD,
    STICKING,
    UNDECIDED,
    UNNAMED,
    USUAL_FRICTION,
    USUAL_LASTING,
    USUAL_MEDIUM,
    USUAL_ONSET,
    USUAL_SHORT,
    VERDICT,
    VISCOUS,
    WAKE,
    DecisionRules,
    DecisionState,
)
from monitor.observer.lagged_motion import EMPTY, FIRST, TAINTED
from monitor.observer.lateness import (
    TAU,
    compare_motion,
    follow_lateness,
    forget_lateness,
    is_constant,
    is_late,
    lateness_changes,
    response_to,
    rubs,
    rubs_beside,
    seems_late,
    seems_to_grow,
    slides,
    told_lateness,
    unsure_lateness,
)
from monitor.observer.missing_force import (
    DRY_BARE,
    JITTERS,
    LATE_UNIT,
    MOVED,
    UNSURE_INPUT,
    E,
)
from monitor.observer.window_statistics import (
    SEEN,
    add_unrecorded,
    drive_explains,
    dry_force,
    friction,
    lasting_energy,
    mean_square,
    onset_evidence,
    rest,
    reversals,
    unrecorded_friction,
)
from monitor.signals import Codes, fill
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part

(
    HEAD, FILLED, SINCE_START, QUIET, OUTSIDE, ONSET, DEPARTURE_AGO, AGREED, DISAGREED, CHANGED,
    ABOVE, JUMP_AGO, WAS_JUDGING, LASTED, KNOWN_AGO, GAP_AGO,
) = range(16)  # fmt: skip
"""Indices of `decision_state.Counts` as constants for the kernel."""
LOOKS = 3
"""Consecutive samples that must agree on friction."""
LEAST_LOOK = 12
"""Delay from the onset before friction is named [samples]."""
FITS, DRY_PART = 0.7, 0.5
"""Shares of the missing force, beyond noise, that friction must explain and that its dry part must
contain; real friction also has presliding and the Stribeck effect, which neither part describes.
"""
LEFT, LEFT_EARLY = 0.55, 0.8
"""Shares of the force of dry friction alone that must be left beside viscous friction, over longer
windows and over those shorter than `MEDIUM`, which hardly tell the two apart: what grows with the
speed, as drag, a saturated drive and a lost gain of it do, leaves less.
"""
LEFT_UNSURE, AGREED_UNRECORDED = 0.75, 64
"""The first of these over seconds of a motion that was not recorded, and consecutive samples that
must agree there: what the equations mispredict of faster or larger motion grows with the speed. So
does what a lateness of the inputs that is allowed for leaves of another fault.
"""
OUTDONE, NOISE = 3.0, 0.02
"""Ratio of the energy that friction leaves to that which a weaker drive leaves above which it is
the drive, and share below which what is left is not told from noise: a saturated drive, a dead band
and a lost gain leave much of what dry friction alone would explain, at motions in phase with them.
"""
AT_REST, STUCK = 0.25, 0.5
"""Share of the time at rest above which it is stiction."""
OVER = 256
"""Samples without a departure after which an episode ends."""
VIOLATED = 16
"""Consecutive samples in which the sensors must disagree."""
SURE, SURELY_NEW, REMAINS = 2.0, 1.25, 128
"""Ratio to the limit above which a deviation is a departure at once; the same for a residual that
is compared with what a healthy rig left at this very motion; and samples after which a smaller one
is a departure: transients of a drive change are small or short.
"""
SUDDEN, LATE, BEFORE = 8.0, 16.0, 256.0
"""Ratio of the drive's energy over `LATE` samples to that over `BEFORE` above which the drive has
just started or increased, and the motion is not steady.
"""


@kernel()
def decide(  # noqa: PLR0917 -- a kernel
    judged: FloatArray,
    speed: FloatArray,
    levels: FloatArray,
    drive: FloatArray,
    inside: NDArray[np.bool_],
    jumped: NDArray[np.bool_],
    steady: NDArray[np.bool_],
    usual: FloatArray,
    response: FloatArray,
    altered: FloatArray,
    state: Codes,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> None:
    """Fill the columns of `OUTPUTS`, shape (outputs, n), sample by sample."""
    for k in range(state.size):
        if state[k] == EMPTY:
            continue
        if state[k] == FIRST:
            _restart(kept)
        _follow_drive(drive[k], steady[k], kept)
        kept.counts[GAP_AGO] = 0 if state[k] == TAINTED else kept.counts[GAP_AGO] + 1
        judged[k, LATE_UNIT] = response_to(judged[k, LATE_UNIT], kept.lateness)
        if state[k] != TAINTED:
            _follow_inputs(kept, judged[k], usual[:, k], altered[k], rules)
            _remember(kept, judged[k], speed[k], levels[k])
        _follow_jumps(jumped[k], kept)
        _one(k, inside[k], usual[:, k], response[k], rules, kept, out)


@part()
def _restart(kept: DecisionState) -> None:
    fill(kept.counts, 0)
    kept.counts[ONSET] = -1
    kept.counts[JUMP_AGO] = WAKE
    fill(kept.value, 0.0)
    kept.value[0] = UNNAMED
    forget_lateness(kept.lateness)
    fill(kept.edges, 0.0)
    fill(kept.instants, 0.0)


@part()
def _follow_drive(energy: float, steady: bool, kept: DecisionState) -> None:
    """Detect a sudden start or increase of the drive; or it is known not to be steady."""
    late, before = kept.value[2], kept.value[3]
    late += (energy - late) / LATE
    before += (energy - before) / BEFORE
    kept.counts[CHANGED] += 1
    if late > SUDDEN * before + 1e-4 or not steady:
        kept.counts[CHANGED] = 0
    kept.value[2], kept.value[3] = late, before


@part()
def _follow_jumps(jumped: bool, kept: DecisionState) -> None:
    """Handle a jump: another fault while armed, otherwise settling starts again."""
    count = kept.counts
    count[JUMP_AGO] = min(count[JUMP_AGO] + 1, WAKE)
    if not jumped:
        return
    if count[WAS_JUDGING] == 0:
        count[CHANGED] = 0
        return
    count[JUMP_AGO], count[DEPARTURE_AGO] = 0, 0
    count[ONSET] = max(count[ONSET], 0)
    kept.value[0] = OTHER


@part()
def _follow_inputs(
    kept: DecisionState, row: FloatArray, usual: FloatArray, altered: float, rules: DecisionRules
) -> None:
    """Learn the inputs' edges and lateness, except in an episode, and correct the residual.

    While they change, the rig is not armed.
    """
    count = kept.counts
    judging = count[WAS_JUDGING] == 1
    calm, constant = count[ONSET] < 0, is_constant(kept.lateness)
    largest = min(rules.medium / rules.lasting, usual[USUAL_MEDIUM])
    healthy = _healthy_variance(kept, rules) if calm or not judging else 0.0
    variance = healthy + _late_variance(kept) + mean_square(kept, READ, MEDIUM)
    if calm and follow_edges(row[E], row[MOVED], row[UNSURE_INPUT], largest * variance, kept.edges):
        forget_lateness(kept.lateness)
        count[CHANGED] = 0
    row[E] = corrected(row[E], row[MOVED], kept.edges)
    if not judging or (calm and count[ABOVE] == 0):
        unsure, jitters = row[UNSURE_INPUT], row[JITTERS] > 0.0
        late = kept.lateness[TAU] * row[LATE_UNIT] if constant else 0.0
        follow_instants(row[E] - late, unsure, jitters, healthy, judging, kept.instants)
    count[KNOWN_AGO] = 0 if np.isinf(usual[USUAL_MEDIUM]) else count[KNOWN_AGO] + 1
    anew = 0 < count[KNOWN_AGO] <= LONG
    moves = is_late(kept.lateness) or slides(kept.lateness)
    learns = not judging or (calm and (count[ABOVE] == 0 or moves))
    if learns or (calm and anew):
        variance += edges_unsure(row[UNSURE_INPUT], kept.edges)
        follow_lateness(row, largest * variance, healthy, judging, learns, anew, kept.lateness)
    compare_motion(altered, judging and calm, kept.lateness)
    if is_constant(kept.lateness) != constant:
        # What edges left, and what lasted, was judged beside another lateness.
        fill(kept.instants, 0.0)
        count[LASTED] = 0
    if not judging and lateness_changes(kept.lateness):
        count[CHANGED] = -LONG
    elif not judging and seems_to_grow(kept.lateness):
        count[CHANGED] = 0


@part()
def _remember(kept: DecisionState, row: FloatArray, speed: float, levels: FloatArray) -> None:
    """Store a sample; the first columns are in the order of the residual's."""
    head = kept.counts[HEAD]
    for c in range(DELAYED):
        kept.rows[head, c] = row[c]
    late = kept.lateness[TAU] * row[LATE_UNIT]
    kept.rows[head, ERROR] = row[ERROR] - late
    kept.rows[head, DELAYED] = row[LATE_UNIT]
    kept.rows[head, READ] = still_unsure(row[UNSURE_INPUT], kept.instants)
    kept.rows[head, SPEED], kept.rows[head, BARE] = speed, row[DRY_BARE]
    kept.rows[head, UNDECIDED] = undecided(row[MOVED], kept.edges)
    for c in range(levels.size):
        kept.rows[head, LEVELS + c] = levels[c]
    kept.counts[HEAD] = (head + 1) % HISTORY
    kept.counts[FILLED] = min(kept.counts[FILLED] + 1, HISTORY)


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
def _one(  # noqa: PLR0917 -- a kernel
    k: int,
    inside: bool,
    usual: FloatArray,
    response: float,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> None:
    count = kept.counts
    count[SINCE_START] += 1
    count[OUTSIDE] = 0 if not inside else min(count[OUTSIDE] + 1, LONG)
    out[AMPLITUDE, k] = mean_square(kept, LEVEL, MEDIUM)
    late = _late_variance(kept)
    edges = mean_square(kept, READ, MEDIUM) + mean_square(kept, UNDECIDED, MEDIUM)
    spread = np.sqrt(_healthy_variance(kept, rules) + late + edges)
    out[SPREAD, k], out[FOUND_LATE, k] = spread, told_lateness(kept.lateness)
    force, viscous, deviations, _, _ = friction(kept, MEDIUM, spread)
    out[FORCE, k], out[VISCOUS, k], out[DEVIATIONS, k] = force, viscous, deviations
    out[REST, k] = rest(kept, LONG, rules.speed_noise)
    sensor_variance = rules.sensor_noise**2 + rules.sensor_growth**2 * mean_square(
        kept, MEASURED, MEDIUM
    )
    out[SENSORS, k] = mean_square(kept, DISAGREE, MEDIUM) / sensor_variance / rules.sensor
    margin = rules.lasting
    short_limit = _energy_limit(rules.short, usual[USUAL_SHORT], rules)
    medium_limit = _energy_limit(rules.medium, usual[USUAL_MEDIUM], rules)
    short = mean_square(kept, ERROR, SHORT) / spread**2 / short_limit
    medium = mean_square(kept, ERROR, MEDIUM) / spread**2 / medium_limit
    allowed = _friction_limit(usual[USUAL_FRICTION], rules)
    largest = max(np.sqrt(short), np.sqrt(medium), deviations / allowed)
    lasting = lasting_energy(kept, spread**2 * usual[USUAL_LASTING] * margin)
    constant = is_constant(kept.lateness)
    out[EVIDENCE, k] = onset_evidence(kept, spread, unsure_lateness(kept.lateness), constant)
    onset = out[EVIDENCE, k] / (usual[USUAL_ONSET] * np.sqrt(margin))
    if (late > 0.0 and not constant) or edges > 0.0 or count[GAP_AGO] < LONG:
        onset = 0.0
    # A motion of another size than under the same drive before: slow evidence, never at once.
    size = min(response, SURE)
    out[DEVIATION, k] = max(largest, np.sqrt(out[SENSORS, k]), np.sqrt(lasting), size, onset)
    away = out[DEVIATION, k] > 1.0
    count[QUIET] = 0 if away else count[QUIET] + 1
    count[ABOVE] = count[ABOVE] + 1 if away else 0
    if count[ONSET] < 0:
        known = 0.0 if np.isinf(usual[USUAL_SHORT]) or late + edges > 0.0 else largest
        away = count[ABOVE] >= REMAINS or _sure(out[DEVIATION, k], known, onset, kept)
    away = away or count[JUMP_AGO] == 0
    mode = _mode(kept, rules)
    out[MODE, k] = mode
    count[WAS_JUDGING] = 1 if mode == JUDGING else 0
    if mode != BEYOND and kept.sums[SEEN] > 0.0:
        fill(kept.sums, 0.0)
    if mode != JUDGING:
        count[ONSET] = -1
        kept.value[0] = UNNAMED
        if mode == BEYOND:
            _unrecorded(k, spread, medium_limit, rules, kept, out)
        return
    _follow(k, away, spread, rules, kept, out)


@part()
def _unrecorded(  # noqa: PLR0917 -- a kernel
    k: int,
    spread: float,
    limit: float,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> None:
    """Name dry friction at a motion that was not recorded.

    How much a healthy rig leaves there is not known, but that it has no reason to reverse with the
    motion: over many reversals, dry friction is told by its shape.
    """
    count = kept.counts
    if kept.sums[SEEN] == 0.0:
        count[AGREED] = 0
    add_unrecorded(kept, spread, rules.speed_noise)
    force, beside, share, dry, drive, energy = unrecorded_friction(kept)
    fits = share > FITS and dry > DRY_PART and beside > LEFT_UNSURE * force
    fits = fits and energy > SURELY_NEW**2 * limit
    # Of a window in which a fault begins, neither explains the part before.
    fits = fits and share > drive and 1.0 - share < OUTDONE * max(1.0 - drive, NOISE)
    count[AGREED] = count[AGREED] + 1 if fits and force > 0.0 else 0
    out[SHARE, k], out[DRY_SHARE, k] = share, dry
    if count[AGREED] >= AGREED_UNRECORDED:
        out[VERDICT, k], out[NAMED_FORCE, k] = FRICTION, force


@part()
def _sure(deviation: float, known: float, onset: float, kept: DecisionState) -> bool:
    """Whether a deviation is a departure at once.

    Where steps that slide fall is not known of every input, and the lateness jumps by a sample.

    Args:
        deviation: the largest.
        known: that of the residual from the healthy one at this very motion; 0 if that or the
            instants of the inputs are not known.
        onset: evidence of the onset of dry friction, relative to its limit at this very motion; 0
            if that or the instants of the inputs are not known.
        kept: the state.
    """
    if is_late(kept.lateness):
        beside = is_constant(kept.lateness)
        rubbing = rubs_beside(kept.lateness) if beside else rubs(kept.lateness)
        return onset > 1.0 or (kept.counts[ABOVE] >= MEDIUM and rubbing)
    new = known > SURELY_NEW or onset > 1.0
    return deviation > SURE or (new and not seems_late(kept.lateness))


@part()
def _late_variance(kept: DecisionState) -> float:
    """Mean square of what is not known of the inputs' lateness."""
    return unsure_lateness(kept.lateness) ** 2 * mean_square(kept, DELAYED, MEDIUM)


@part()
def _healthy_variance(kept: DecisionState, rules: DecisionRules) -> float:
    """The same for its motion, if the instants of the inputs are known."""
    n = min(MEDIUM, kept.counts[FILLED])
    total = rules.noise**2
    for c in range(rules.growth.size):
        level = 0.0
        for ago in range(1, n + 1):
            level += kept.rows[(kept.counts[HEAD] - ago) % HISTORY, LEVELS + c]
        total += rules.growth[c] * level / max(n, 1)
    return total


@part()
def _mode(kept: DecisionState, rules: DecisionRules) -> float:
    """The mode: armed once everything has settled and is quiet, or after a maximum time."""
    count = kept.counts
    if count[SINCE_START] < rules.settle:
        count[OUTSIDE] = min(count[SINCE_START], LONG)
        return ARMING
    if count[JUMP_AGO] < WAKE:
        return JUDGING
    if count[OUTSIDE] < LONG and count[OUTSIDE] < count[SINCE_START]:
        return BEYOND
    if count[CHANGED] < rules.settle and count[ONSET] < 0:
        return ARMING
    if count[QUIET] >= MEDIUM or count[SINCE_START] >= 2 * rules.settle:
        return JUDGING
    return ARMING


@part()
def _follow(  # noqa: PLR0917 -- a kernel
    k: int,
    away: bool,
    spread: float,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> None:
    """Begin, continue or end an episode, and name it."""
    count = kept.counts
    if away:
        count[DEPARTURE_AGO] = 0
        if count[ONSET] < 0:
            count[ONSET], count[AGREED], count[DISAGREED] = 0, 0, 0
            kept.value[0], kept.value[1] = UNNAMED, 0.0
    elif count[ONSET] >= 0:
        count[DEPARTURE_AGO] += 1
        if count[DEPARTURE_AGO] > OVER:
            count[ONSET] = -1
            kept.value[0] = UNNAMED
    out[DEPARTED, k] = 1.0 if away else 0.0
    if count[ONSET] >= 0:
        count[ONSET] += 1
        kept.value[0] = _verdict(k, spread, rules, kept, out)
    out[VERDICT, k] = kept.value[0]
    out[NAMED_FORCE, k] = kept.value[1]


@part()
def _verdict(
    k: int, spread: float, rules: DecisionRules, kept: DecisionState, out: FloatArray
) -> float:
    count, before = kept.counts, kept.value[0]
    count[DISAGREED] = count[DISAGREED] + 1 if out[SENSORS, k] > 1.0 else 0
    if before == OTHER or count[DISAGREED] >= VIOLATED:
        return OTHER
    since = count[ONSET]
    length = min(since + SHORT, LONG)
    beside, _, _, share, dry = friction(kept, length, spread)
    force, acting = dry_force(kept, since, length, rules.high_pass)
    out[SHARE, k], out[DRY_SHARE, k] = share, dry
    known = LEFT_UNSURE if is_late(kept.lateness) else LEFT
    least = LEFT_EARLY if length < MEDIUM else known
    fits = share > FITS and dry > DRY_PART and force > 0.0 and beside > least * force
    drive = drive_explains(kept, length, spread)
    fits = fits and 1.0 - share < OUTDONE * max(1.0 - drive, NOISE)
    turned = reversals(kept, length, rules.speed_noise) > 0
    still = rest(kept, length, rules.speed_noise)
    sticks = since >= LONG // 2 and still > AT_REST and out[DEPARTED, k] > 0.0
    agrees = since >= LEAST_LOOK and ((fits and turned) or sticks)
    count[AGREED] = count[AGREED] + 1 if agrees and count[DISAGREED] == 0 else 0
    if fits:
        kept.value[1] = acting
    if count[AGREED] >= LOOKS or before in (FRICTION, STICKING):
        return STICKING if still > STUCK or before == STICKING else FRICTION
    return OTHER if since > rules.patience else UNNAMED
