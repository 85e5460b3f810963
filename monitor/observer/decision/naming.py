"""The fault of an episode: dry friction, stiction, another one, or not named yet.

A departure is friction if, since its onset, dry friction explains the residual better than viscous
friction and a weaker drive do, the motion has reversed, and the sensors agree with each other.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from monitor.observer.decision.decision_state import (
    AGREED,
    DEPARTED,
    DEPARTURE_AGO,
    DISAGREED,
    DRY_SHARE,
    FRICTION,
    LONG,
    MEDIUM,
    NAMED_FORCE,
    ONSET,
    OTHER,
    SENSORS,
    SHARE,
    SHORT,
    STICKING,
    UNNAMED,
    VERDICT,
    DecisionRules,
    DecisionState,
)
from monitor.observer.decision.deviation import SURELY_NEW
from monitor.observer.decision.told_force import dry_force, force_of_changed_motion
from monitor.observer.decision.window_statistics import (
    SEEN,
    add_unrecorded,
    drive_explains,
    friction,
    rest,
    reversals,
    rings,
    unrecorded_friction,
)
from monitor.observer.lateness import is_late
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

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
AT_REST, STUCK, RESTS = 0.25, 0.5, 0.1
"""Share of the time at rest above which it is stiction; and above which the motion is unlike any
healthy one, so that the weights of healthy recordings tell nothing of it.
"""
OVER = 256
"""Samples without a departure after which an episode ends."""
VIOLATED = 16
"""Consecutive samples in which the sensors must disagree."""


@part()
def follow_episode(  # noqa: PLR0917 -- a kernel
    k: int,
    away: bool,
    spread: float,
    rules: DecisionRules,
    kept: DecisionState,
    out: FloatArray,
) -> None:
    """Begin, continue or end the episode of sample `k`, and name its fault.

    Args:
        k: the sample.
        away: whether it departs.
        spread: what a healthy rig leaves, as a standard deviation.
        rules, kept, out: as in `decide`.
    """
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
    force, acting = dry_force(kept, since, length, rules.high_pass)
    fits, out[SHARE, k], out[DRY_SHARE, k] = _fits(kept, length, spread, force, False)
    if not fits and rings(kept, length, spread):
        fits = _fits(kept, length, spread, force, True)[0]
    turns = reversals(kept, length, rules.speed_noise)
    still = rest(kept, length, rules.speed_noise)
    sticks = since >= LONG // 2 and still > AT_REST and out[DEPARTED, k] > 0.0
    agrees = since >= LEAST_LOOK and ((fits and turns > 0) or sticks)
    count[AGREED] = count[AGREED] + 1 if agrees and count[DISAGREED] == 0 else 0
    if fits and (since < LONG or still > RESTS):
        kept.value[1] = acting
    elif fits and (since % SHORT == 0 or kept.value[1] == 0.0):
        kept.value[1] = force_of_changed_motion(acting, since, rules, kept)
    if count[AGREED] >= LOOKS or before in (FRICTION, STICKING):
        return STICKING if still > STUCK or before == STICKING else FRICTION
    return OTHER if since > rules.patience else UNNAMED


@part()
def _fits(
    kept: DecisionState, length: int, spread: float, force: float, averaged: bool
) -> tuple[bool, float, float]:
    """Whether dry friction explains the residual over a window better than anything else.

    Of the ringing of a sensor, near half the sample rate, means of two neighbours leave little.

    Args:
        kept, length, spread, averaged: as for `friction`.
        force: of dry friction alone [N].

    Returns:
        That, and the two shares of `friction`.
    """
    beside, _, _, share, dry = friction(kept, length, spread, averaged)
    known = LEFT_UNSURE if is_late(kept.lateness) else LEFT
    least = LEFT_EARLY if length < MEDIUM else known
    fits = share > FITS and dry > DRY_PART and force > 0.0 and beside > least * force
    drive = drive_explains(kept, length, spread, averaged)
    return fits and 1.0 - share < OUTDONE * max(1.0 - drive, NOISE), share, dry


@part()
def name_unrecorded(  # noqa: PLR0917 -- a kernel
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
