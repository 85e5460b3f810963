"""Window statistics for the observer's decision: energies, friction, rest."""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.observer.decision.decision_state import (
    BARE,
    DELAYED,
    DRIVEN,
    DRY,
    ERROR,
    FILLED,
    HEAD,
    HISTORY,
    LASTED,
    LASTING,
    MEDIUM,
    RISING,
    SPEED,
    SUMS,
    WAS_JUDGING,
    WET,
    DecisionState,
)
from rigwatch.wire.kernel import part

(
    SEEN, USED, DRY_DRY, DRY_WET, WET_WET, DRY_ERROR, WET_ERROR, DRIVEN_DRIVEN, DRIVEN_ERROR,
    ENERGY, HEALTHY, TURNS, SIDE,
) = range(SUMS)  # fmt: skip
"""Sums over a motion that was not recorded: its samples, those that count, products of columns,
energies of the residual and of a healthy one, reversals, and the direction of the motion.
"""
UNRECORDED, FEWEST_TURNS = 256, 4.0
"""Memory of these sums [samples], and reversals in it from which on they tell friction."""
ALIKE = 0.82
"""Squared cosine between the responses to dry and viscous friction above which a motion does not
tell them apart: about 2/π under Gaussian noise, and at least 8/π² under a tone, where any small
error of the equations decides how much looks dry.
"""
BURST = 3.0
"""Largest energy of a sample that counts for a lasting change, relative to the limit."""
SHORTEST = 4
"""Fewest samples in which the onset of friction is looked for."""
RINGS = 4.0
"""Ratio of the energy of half the changes from sample to sample to that of noise, which is half of
the residual's, from which on a sensor rings."""
RIDGE = 1e-3
"""Correlation of the viscous and the dry regressor above which they cannot be distinguished."""


@part()
def mean_square(kept: DecisionState, column: int, length: int) -> float:
    """Mean square of a column over the last samples."""
    n = min(length, kept.counts[FILLED])
    total = 0.0
    for ago in range(1, n + 1):
        total += kept.rows[(kept.counts[HEAD] - ago) % HISTORY, column] ** 2
    return total / max(n, 1)


@part()
def lasting_energy(kept: DecisionState, allowed: float) -> float:
    """Mean square of the residual over `LASTING` judged samples; 0 until there are as many.

    Args:
        kept: the newest sample is added to it.
        allowed: the limit of the mean square in the present motion, to which it is relative.
    """
    count = kept.counts
    if count[WAS_JUDGING] == 0:
        count[LASTED] = 0
        return 0.0
    newest = kept.rows[(count[HEAD] - 1) % HISTORY, ERROR]
    kept.lasting[count[LASTED] % LASTING] = min(newest**2 / allowed, BURST)
    count[LASTED] += 1
    if count[LASTED] < LASTING:
        return 0.0
    total = 0.0
    for i in range(LASTING):
        total += kept.lasting[i]
    return total / LASTING


@part()
def slides(kept: DecisionState, ago: int) -> bool:
    """Whether the motion has kept its direction long enough for real friction to change sign.

    Contacts deform before they slide, and sensors are delayed.
    """
    head = kept.counts[HEAD]
    speed = kept.rows[(head - ago) % HISTORY, SPEED]
    for before in range(1, RISING + 1):
        if speed * kept.rows[(head - ago - before) % HISTORY, SPEED] <= 0.0:
            return False
    return True


@part()
def slides_on(kept: DecisionState, ago: int) -> bool:
    """Whether it slides and the speed, going on as it does, keeps its direction to the next sample.

    Strong friction bends the speed where it reverses, and smoothing delays the reversal of a bent
    speed, so that the force has changed sign in the sample before.
    """
    head = kept.counts[HEAD]
    speed = kept.rows[(head - ago) % HISTORY, SPEED]
    following = 2.0 * speed - kept.rows[(head - ago - 1) % HISTORY, SPEED]
    return bool(speed * following > 0.0) and slides(kept, ago)


@part()
def counts(kept: DecisionState, ago: int, averaged: bool) -> bool:
    """Whether a sample counts for friction; of a mean of two neighbours, whether both do."""
    return slides_on(kept, ago) and (not averaged or slides_on(kept, ago + 1))


@part()
def friction(
    kept: DecisionState, length: int, spread: float, averaged: bool = False
) -> tuple[float, float, float, float, float]:
    """Coulomb force, viscous coefficient, the former in standard deviations, and two shares.

    The shares are of the residual beyond its healthy variance: explained by both friction terms,
    and contained in the dry term.

    Args:
        kept: the window's rows.
        length: of the window [samples].
        spread: of the healthy residual at this motion.
        averaged: of each two neighbours the mean counts, see `rings`.
    """
    n = min(length, kept.counts[FILLED])
    used = 0
    a = b = c = p = q = yy = 0.0
    for ago in range(1, n + 1):
        if not counts(kept, ago, averaged):
            continue
        row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
        before = kept.rows[(kept.counts[HEAD] - ago - averaged) % HISTORY]
        dry_now = 0.5 * (row[DRY] + before[DRY])
        wet_now = 0.5 * (row[WET] + before[WET])
        error_now = 0.5 * (row[ERROR] + before[ERROR])
        used += 1
        a += dry_now * dry_now
        b += dry_now * wet_now
        c += wet_now * wet_now
        p += dry_now * error_now
        q += wet_now * error_now
        yy += error_now * error_now
    healthy = used * spread * spread * (0.5 if averaged else 1.0)
    force, viscous, left, both, dry = solved(a, b, c, p, q, yy, healthy)
    return force, viscous, force * np.sqrt(left) / spread, both, dry


@part()
def onset_evidence(kept: DecisionState, spread: float, unsure: float, jumps: bool) -> float:
    """Evidence of dry friction that has just begun, in standard deviations; 0 if it would push.

    Of the windows that end now, the largest of the likelihood ratio's root for a force of dry
    friction alone in them: a test for a change of unknown size at an unknown instant (A. Willsky,
    H. Jones, IEEE Transactions on Automatic Control 21, 1976). Beside viscous friction, a steady
    motion leaves a fifth of the evidence. What is not high-passed is the response to a force that
    begins, as long as the windows are short beside the high-pass.

    Args:
        kept: the state.
        spread: of the healthy residual at this motion.
        unsure: lateness of the inputs that is not known [samples]: what it may leave is none.
        jumps: whether inputs that are late may jump to another lateness, as a clock slips. One that
            leaves as little is none either.
    """
    most = latest = a = p = late = late_error = late_bare = 0.0
    for ago in range(1, min(MEDIUM, kept.counts[FILLED]) + 1):
        row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
        a += row[BARE] * row[BARE]
        p += row[BARE] * row[ERROR]
        late += row[DELAYED] * row[DELAYED]
        late_error += row[DELAYED] * row[ERROR]
        late_bare += row[DELAYED] * row[BARE]
        surely = p - unsure * abs(late_bare)
        if ago >= SHORTEST and surely > 0.0 and a > 0.0:
            most = max(most, surely * surely / a)
        if ago >= SHORTEST and late > 0.0:
            latest = max(latest, late_error * late_error / late)
    return 0.0 if jumps and latest > most else np.sqrt(most) / spread


@part()
def rings(kept: DecisionState, length: int, spread: float) -> bool:
    """Whether the residual changes from sample to sample by far more than a healthy one.

    A sensor on a springy bracket, or one that is a mass on a spring itself, rings after each jump
    of a force: what friction does when the motion reverses, and a healthy motion hardly.

    Args:
        kept, length, spread: as for `friction`.
    """
    n = min(length, kept.counts[FILLED])
    used, changing = 0, 0.0
    for ago in range(1, n + 1):
        if counts(kept, ago, True):
            row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
            before = kept.rows[(kept.counts[HEAD] - ago - 1) % HISTORY]
            used += 1
            changing += (0.5 * (row[ERROR] - before[ERROR])) ** 2
    return bool(changing > RINGS * 0.5 * used * spread * spread)


@part()
def solved(  # noqa: PLR0917 -- sums
    a: float, b: float, c: float, p: float, q: float, yy: float, healthy: float
) -> tuple[float, float, float, float, float]:
    """Coulomb force, viscous coefficient, what determines the former, and the two shares.

    Args:
        a, b, c: products of the dry and the viscous regressor with themselves and each other.
        p, q: their products with the residual.
        yy: energy of the residual.
        healthy: the same of a healthy rig.
    """
    if a <= 0.0 or c <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    c_ridged = c * (1.0 + RIDGE)
    left = max(a - b * b / c_ridged, 1e-9 * a)
    force = (p - b * q / c_ridged) / left
    viscous = (q - b * force) / c_ridged
    explained = 2.0 * (force * p + viscous * q)
    explained -= force * force * a + 2.0 * force * viscous * b + viscous * viscous * c
    beyond = _beyond(yy, healthy)
    dry_alone = p * p / a if p > 0.0 else 0.0
    return force, viscous, left, explained / beyond, dry_alone / beyond


@part()
def _beyond(energy: float, healthy: float) -> float:
    """Energy of the residual beyond that of a healthy rig."""
    return max(energy - healthy, 0.2 * energy)


@part()
def drive_explains(
    kept: DecisionState, length: int, spread: float, averaged: bool = False
) -> float:
    """Share of the residual beyond its healthy variance that a weaker drive explains.

    Of the same samples as the shares of `friction`, same arguments.
    """
    n = min(length, kept.counts[FILLED])
    used = 0
    a = p = yy = 0.0
    for ago in range(1, n + 1):
        if not counts(kept, ago, averaged):
            continue
        row = kept.rows[(kept.counts[HEAD] - ago) % HISTORY]
        before = kept.rows[(kept.counts[HEAD] - ago - averaged) % HISTORY]
        driven_now = 0.5 * (row[DRIVEN] + before[DRIVEN])
        error_now = 0.5 * (row[ERROR] + before[ERROR])
        used += 1
        a += driven_now * driven_now
        p += driven_now * error_now
        yy += error_now * error_now
    return _drive_share(a, p, yy, used * spread * spread * (0.5 if averaged else 1.0))


@part()
def _drive_share(a: float, p: float, yy: float, healthy: float) -> float:
    """Share of a residual beyond `healthy` that a weaker drive explains."""
    return p * p / (a * _beyond(yy, healthy)) if p > 0.0 and a > 0.0 and yy > 0.0 else 0.0


@part()
def add_unrecorded(kept: DecisionState, spread: float, slow: float) -> None:
    """Add the newest sample to the sums over a motion that was not recorded.

    They forget exponentially. As in short windows, samples around reversals do not count.

    Args:
        kept: the state.
        spread: of the healthy residual at this motion, as far as known.
        slow: speed that cannot be distinguished from rest.
    """
    sums, row = kept.sums, kept.rows[(kept.counts[HEAD] - 1) % HISTORY]
    sums[SEEN] += 1.0
    for i in range(USED, TURNS + 1):
        sums[i] *= 1.0 - 1.0 / UNRECORDED
    if abs(row[SPEED]) > slow:
        side = 1.0 if row[SPEED] > 0.0 else -1.0
        sums[TURNS] += 1.0 if sums[SIDE] == -side else 0.0
        sums[SIDE] = side
    if not slides_on(kept, 1):
        return
    sums[USED] += 1.0
    sums[DRY_DRY] += row[DRY] * row[DRY]
    sums[DRY_WET] += row[DRY] * row[WET]
    sums[WET_WET] += row[WET] * row[WET]
    sums[DRY_ERROR] += row[DRY] * row[ERROR]
    sums[WET_ERROR] += row[WET] * row[ERROR]
    sums[DRIVEN_DRIVEN] += row[DRIVEN] * row[DRIVEN]
    sums[DRIVEN_ERROR] += row[DRIVEN] * row[ERROR]
    sums[ENERGY] += row[ERROR] * row[ERROR]
    sums[HEALTHY] += spread * spread


@part()
def unrecorded_friction(kept: DecisionState) -> tuple[float, float, float, float, float, float]:
    """Friction over a motion that was not recorded, from its sums.

    Returns:
        Force of dry friction alone [N], the same beside viscous friction, shares of the residual
        that both, dry friction alone and a weaker drive explain, and the residual's energy relative
        to the healthy one; 0 until there is enough motion, at speeds that vary.
    """
    s = kept.sums
    alike = s[DRY_WET] ** 2 > ALIKE * s[DRY_DRY] * s[WET_WET]
    if s[SEEN] < 2.0 * UNRECORDED or s[TURNS] < FEWEST_TURNS or s[DRY_DRY] <= 0.0 or alike:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    beside, _, _, both, dry = solved(
        s[DRY_DRY], s[DRY_WET], s[WET_WET], s[DRY_ERROR], s[WET_ERROR], s[ENERGY], s[HEALTHY]
    )
    drive = _drive_share(s[DRIVEN_DRIVEN], s[DRIVEN_ERROR], s[ENERGY], s[HEALTHY])
    return s[DRY_ERROR] / s[DRY_DRY], beside, both, dry, drive, s[ENERGY] / s[HEALTHY]


@part()
def rest(kept: DecisionState, length: int, slow: float) -> float:
    """Share of the time at which the motion cannot be distinguished from rest."""
    n = min(length, kept.counts[FILLED])
    still = 0
    for ago in range(1, n + 1):
        still += abs(kept.rows[(kept.counts[HEAD] - ago) % HISTORY, SPEED]) < slow
    return still / max(n, 1)


@part()
def reversals(kept: DecisionState, length: int, slow: float) -> int:
    """Number of reversals of the motion beyond noise."""
    n = min(length, kept.counts[FILLED])
    found, side = 0, 0
    for ago in range(n, 0, -1):
        speed = kept.rows[(kept.counts[HEAD] - ago) % HISTORY, SPEED]
        now = 1 if speed > slow else (-1 if speed < -slow else 0)
        if now != 0:
            found += side == -now
            side = now
    return found
