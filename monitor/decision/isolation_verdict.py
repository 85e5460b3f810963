"""What to call a departure: dry friction, sticking, another excitation, or another fault.

Dry friction is named where one of six patterns holds over three looks in a row, and stays named
until the episode ends. Before the first reversal friction is a constant force; two patterns are
plain enough to count as soon as there has been one, two more from half a cycle on, the weakest two
once the onset has rung off, as no rival describes how a rig goes from one motion to another. What
has not been named by then is another fault. All figures that this rests on stand here; they are
shares of energies and correlations, so they hold for any rig, drive and unit.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

from numba import njit

from monitor.decision.isolation import Evidence
from monitor.decision.kernel_state import (  # fmt: skip
    FRICTION,
    LONG,
    NEW_EXCITATION,
    OTHER,
    STICKING,
    WatchState,
)

LOOKS = 3
"""Looks in a row, four samples apart, that must agree on friction: one may be chance."""
RUNG_OFF, GIVE_UP = 3, 4
"""Cycles of the motion after which an onset has rung off: two are looked at, one is left out. One
more, and 64 samples, and what could not be named as friction is not friction.
"""
LEAST_JUMP = 30.0
"""Energy of the jump in the noise's variance: χ² of one sample beyond any doubt."""
LEAST_SHARE, LEAST_DRY = 0.003, 0.2
"""The jump and the Coulomb part must matter in what is seen, or they are a detail of a rival."""
CERTAIN_RHO, CERTAIN_FIT = 0.9, 0.95
"""The jump explains what the rivals leave (ρ² = 0.8), friction all but the scatter of its filter,
which explains 95 % of the known fault at worst.
"""
PLAIN_RHO, PLAIN_FIT, PLAIN_SHARE, PLAIN_DRY = 0.6, 0.8, 0.01, 0.3
"""A jump that can hardly be mistaken: in no run of 2500 with other faults has one been seen."""
JUMP_RHO, JUMP_FIT = 0.35, 0.6
"""Heavy or uneven friction bends the motion, and the linear filter explains less of it."""
FOLLOW_FIT, FOLLOW_DRY, FOLLOW_SHARE, FOLLOW_RHO = 0.93, 0.3, 0.001, 0.2
"""Weak friction: the rivals can mimic most of it, but not with a Coulomb part of a third."""
THIN_SHARE, THIN_RHO = 0.3, 0.6
"""The jump alone is a third of all that is seen."""
STILL, STILL_TOGETHER, STILL_RHO = 0.04, 0.7, -0.5
"""Slip and stick: at rest for longer than a smooth motion is at its turning points and not in one
cycle only, in a change that is not chaos, and with no jump that plainly feeds energy in, as that of
a fading drive does. Unless it is stuck for good, rubbing also takes energy out while it slips: its
Coulomb part is positive, which that of a rig damped to rest is not.
"""
STUCK = 0.5
"""At rest for half the time: stiction rather than friction."""
SPIKE = 0.5
"""Share of the energy in one sample; no friction lasts one sample."""
SURE_SHARE = 0.1
"""A jump of this share counts also where the position has not moved yet."""
NEW_DRIVE = 0.1
"""Swing of the voltage's change, in that of the voltage, that makes it another excitation."""


class Seen(NamedTuple):
    """What one look sees beside the evidence.

    Args:
        before: the verdict so far.
        since: samples since the departure.
        cycle: of the motion, at least 32 [samples].
        moved_voltage, moved_position, moved_acceleration: which channels left the healthy period.
        voltage_swing: standard deviation of the voltage's change, in that of the voltage.
        spread: of the residual's change when healthy [m/s^2].
    """

    before: float
    since: int
    cycle: int
    moved_voltage: bool
    moved_position: bool
    moved_acceleration: bool
    voltage_swing: float
    spread: float


@njit()
def verdict(seen: Seen, evidence: Evidence, state: WatchState) -> float:
    """The verdict after one more look."""
    if seen.moved_voltage and not seen.moved_acceleration:
        return OTHER
    if seen.voltage_swing > NEW_DRIVE and seen.moved_acceleration:
        return NEW_EXCITATION
    agrees = _friction(seen, evidence)
    state.counts.agreed = state.counts.agreed + 1 if agrees else 0
    if seen.before in (FRICTION, STICKING) or state.counts.agreed >= LOOKS:
        stuck = evidence.rest >= STUCK and seen.moved_acceleration
        return STICKING if stuck else FRICTION
    return OTHER if _other(seen, evidence) else seen.before


@njit()
def _friction(seen: Seen, evidence: Evidence) -> bool:
    """Whether this look finds dry friction."""
    if not seen.moved_acceleration or evidence.peak > SPIKE:
        return False
    if not (seen.moved_position or evidence.share > SURE_SHARE):
        return False
    if _certain(seen, evidence) or _slips(seen, evidence):
        return True
    if 2 * seen.since >= seen.cycle and (_plain(evidence) or _follows(evidence)):
        return True
    settled = seen.since >= RUNG_OFF * seen.cycle
    return settled and (_jumps(seen, evidence) or _thin(evidence))


@njit()
def _jump_seen(seen: Seen, evidence: Evidence) -> bool:
    large = evidence.jump > LEAST_JUMP * seen.spread**2
    return large and evidence.share > LEAST_SHARE and evidence.dry > LEAST_DRY


@njit()
def _certain(seen: Seen, evidence: Evidence) -> bool:
    """Nothing but friction is left over."""
    plain = evidence.rho > CERTAIN_RHO and evidence.explained > CERTAIN_FIT
    return plain and _jump_seen(seen, evidence)


@njit()
def _plain(evidence: Evidence) -> bool:
    """A plain jump, in a change that is friction for the greater part."""
    fits = evidence.rho > PLAIN_RHO and evidence.explained > PLAIN_FIT
    return fits and evidence.share > PLAIN_SHARE and evidence.dry > PLAIN_DRY


@njit()
def _jumps(seen: Seen, evidence: Evidence) -> bool:
    """A jump that no rival has, in a change that friction explains more than half of."""
    plain = evidence.rho > JUMP_RHO and evidence.explained > JUMP_FIT
    return plain and _jump_seen(seen, evidence)


@njit()
def _follows(evidence: Evidence) -> bool:
    """A change that follows the friction filter closely."""
    fits = evidence.explained > FOLLOW_FIT and evidence.dry > FOLLOW_DRY
    return fits and evidence.share > FOLLOW_SHARE and evidence.rho > FOLLOW_RHO


@njit()
def _thin(evidence: Evidence) -> bool:
    """Hardly anything but the jump."""
    return evidence.share > THIN_SHARE and evidence.rho > THIN_RHO


@njit()
def _slips(seen: Seen, evidence: Evidence) -> bool:
    """The mass stands still where the healthy one moves."""
    if seen.since < seen.cycle or seen.before == OTHER:
        return False
    orderly = evidence.together > STILL_TOGETHER and evidence.rho > STILL_RHO
    again = evidence.rest > STILL and evidence.rest_always > 0.0
    rubs = evidence.dry > 0.0 or evidence.rest >= STUCK
    return again and orderly and rubs


@njit()
def _other(seen: Seen, evidence: Evidence) -> bool:
    """Whether it is time to call it another fault."""
    if seen.since >= GIVE_UP * seen.cycle + LONG:
        return True
    if seen.since >= seen.cycle and evidence.peak > SPIKE:
        return True
    alone = seen.moved_position and not seen.moved_acceleration
    return alone and seen.since >= RUNG_OFF * seen.cycle
