"""Names a departure: dry friction, stiction, another excitation, or another fault.

Dry friction is named if one of six patterns holds in three tests in a row, and stays named until
the episode ends. Before the first reversal friction is a constant force. Two patterns are clear
enough to count after one reversal, two more after half a cycle, and the weakest two after the onset
transient has decayed, as no rival describes the transition between two motions. A departure not
named by then is another fault. All constants are defined here; they are shares of energy and
correlations, so they apply to any rig, drive and unit.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

from monitor.decision.isolation import Evidence
from monitor.decision.kernel_state import (  # fmt: skip
    FRICTION,
    LONG,
    NEW_EXCITATION,
    OTHER,
    STICKING,
    WatchState,
)
from rigwatch.wire.kernel import part

LOOKS = 3
"""Consecutive tests, four samples apart, that must agree on friction; one may be chance."""
RUNG_OFF, GIVE_UP = 3, 4
"""Cycles of the motion after which an onset transient has decayed: one is skipped, two are tested.
After one more cycle and 64 samples, a departure that is not named friction is another fault.
"""
LEAST_JUMP = 30.0
"""Energy of the jump over the noise variance: χ² of one sample, far beyond chance."""
LEAST_SHARE, LEAST_DRY = 0.003, 0.2
"""Smallest shares of the jump and of the Coulomb part; below, they are a detail of a rival."""
CERTAIN_RHO, CERTAIN_FIT = 0.9, 0.95
"""The jump explains the rivals' residual (ρ² = 0.8), and friction all but the error of its filter,
which explains at least 95 % of the known fault.
"""
PLAIN_RHO, PLAIN_FIT, PLAIN_SHARE, PLAIN_DRY = 0.6, 0.8, 0.01, 0.3
"""Share of an unmistakable jump: none of 2500 runs with other faults reached it."""
JUMP_RHO, JUMP_FIT = 0.35, 0.6
"""Limits for heavy or uneven friction, which distorts the motion so that the filter explains less.
"""
FOLLOW_FIT, FOLLOW_DRY, FOLLOW_SHARE, FOLLOW_RHO = 0.93, 0.3, 0.001, 0.2
"""Limits for weak friction: rivals can mimic most of it, but not a Coulomb part of one third."""
THIN_SHARE, THIN_RHO = 0.3, 0.6
"""The jump alone is one third of the change."""
STILL, STILL_TOGETHER, STILL_RHO = 0.04, 0.7, -0.5
"""Stick-slip: at rest for longer than a smooth motion is at its turning points, again and again, in
a change that is not chaotic, and without a jump that clearly supplies energy, as that of a fading
drive does. Unless the mass is stuck permanently, friction also dissipates energy while it slips:
its Coulomb part is positive, unlike that of a rig damped to rest.
"""
LONG_STILL = 0.15
"""Share of the time at rest below which the mass slides most of the time. Friction is then seen in
its sliding, too; otherwise the motion is merely slow at its turning points, as where it fades for a
while or a square wave moves the mass from stop to stop.
"""
AGAIN = 2
"""Number of stops that is more than chance: after a sudden change the mass may rest once."""
STUCK = 0.5
"""Share of the time at rest above which it is stiction rather than friction."""
SPIKE = 0.5
"""Share of the energy in one sample above which it is a spike, not friction."""
SURE_SHARE = 0.1
"""Share of a jump that counts even if the position has not deviated yet."""
NEW_DRIVE = 0.1
"""Amplitude of the change of voltage, relative to the voltage's, of another excitation."""


class Seen(NamedTuple):
    """Observations of one test besides the evidence.

    Args:
        before: the verdict so far.
        since: samples since the departure.
        cycle: of the motion, at least 32 [samples].
        moved_voltage, moved_position, moved_acceleration: channels that left the healthy period.
        voltage_swing: standard deviation of the change of voltage, relative to the voltage's.
        spread: healthy standard deviation of the change of the residual [m/s^2].
    """

    before: float
    since: int
    cycle: int
    moved_voltage: bool
    moved_position: bool
    moved_acceleration: bool
    voltage_swing: float
    spread: float


@part()
def verdict(seen: Seen, evidence: Evidence, state: WatchState) -> float:
    """The verdict after one more test."""
    # A changed reading of the drive without a changed motion is a fault of that channel.
    if seen.moved_voltage and not seen.moved_acceleration:
        return OTHER
    if seen.voltage_swing > NEW_DRIVE and seen.moved_acceleration:
        return NEW_EXCITATION
    # One test may agree by chance; once named, friction stays named until the episode ends.
    agrees = _friction(seen, evidence)
    state.counts.agreed = state.counts.agreed + 1 if agrees else 0
    if seen.before in (FRICTION, STICKING) or state.counts.agreed >= LOOKS:
        stuck = evidence.rest >= STUCK and seen.moved_acceleration
        return STICKING if stuck else FRICTION
    return OTHER if _other(seen, evidence) else seen.before


@part()
def _friction(seen: Seen, evidence: Evidence) -> bool:
    """Whether this test finds dry friction."""
    # Friction acts over many samples: a single large one is a spike of the sensor.
    if not seen.moved_acceleration or evidence.peak > SPIKE:
        return False
    if not (seen.moved_position or evidence.share > SURE_SHARE):
        return False
    if _certain(seen, evidence) or slips(seen, evidence):
        return True
    if 2 * seen.since >= seen.cycle and (_plain(evidence) or _follows(evidence)):
        return True
    # A sudden fault makes the rig ring; weaker patterns count only after that has decayed.
    settled = seen.since >= RUNG_OFF * seen.cycle
    return settled and (_jumps(seen, evidence) or _thin(evidence))


@part()
def _jump_seen(seen: Seen, evidence: Evidence) -> bool:
    large = evidence.jump > LEAST_JUMP * seen.spread**2
    return large and evidence.share > LEAST_SHARE and evidence.dry > LEAST_DRY


@part()
def _certain(seen: Seen, evidence: Evidence) -> bool:
    """Pattern: friction explains the change completely."""
    plain = evidence.rho > CERTAIN_RHO and evidence.explained > CERTAIN_FIT
    return plain and _jump_seen(seen, evidence)


@part()
def _plain(evidence: Evidence) -> bool:
    """Pattern: a clear jump, in a change that is mostly friction."""
    fits = evidence.rho > PLAIN_RHO and evidence.explained > PLAIN_FIT
    return fits and evidence.share > PLAIN_SHARE and evidence.dry > PLAIN_DRY


@part()
def _jumps(seen: Seen, evidence: Evidence) -> bool:
    """Pattern: a jump beyond all rivals, in a change of which friction explains more than half."""
    plain = evidence.rho > JUMP_RHO and evidence.explained > JUMP_FIT
    return plain and _jump_seen(seen, evidence)


@part()
def _follows(evidence: Evidence) -> bool:
    """Pattern: a change that follows the friction filter closely."""
    fits = evidence.explained > FOLLOW_FIT and evidence.dry > FOLLOW_DRY
    return fits and evidence.share > FOLLOW_SHARE and evidence.rho > FOLLOW_RHO


@part()
def _thin(evidence: Evidence) -> bool:
    """Pattern: little but the jump."""
    return evidence.share > THIN_SHARE and evidence.rho > THIN_RHO


@part()
def slips(seen: Seen, evidence: Evidence) -> bool:
    """Pattern: the mass is at rest while the healthy one moves."""
    if seen.since < seen.cycle or seen.before == OTHER:
        return False
    stuck = evidence.rest >= STUCK
    again = evidence.rest_always > 0.0 and (evidence.stops >= AGAIN or stuck)
    orderly = evidence.together > STILL_TOGETHER and evidence.rho > STILL_RHO
    rubs = evidence.dry > 0.0 or stuck
    long = evidence.rest > LONG_STILL or (evidence.rest > STILL and _slides(evidence))
    return long and again and orderly and rubs


@part()
def _slides(evidence: Evidence) -> bool:
    """Whether friction shows in the sliding between stops: as a jump, or as most of the change."""
    jumps = evidence.share > LEAST_SHARE and evidence.rho > JUMP_RHO
    return jumps or (evidence.explained > JUMP_FIT and evidence.dry > LEAST_DRY)


@part()
def _other(seen: Seen, evidence: Evidence) -> bool:
    """Whether the departure is to be named another fault."""
    if seen.since >= GIVE_UP * seen.cycle + LONG:
        return True
    if seen.since >= seen.cycle and evidence.peak > SPIKE:
        return True
    alone = seen.moved_position and not seen.moved_acceleration
    return alone and seen.since >= RUNG_OFF * seen.cycle
