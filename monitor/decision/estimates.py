"""Coulomb and viscous estimates with their limits (5.39), at each hop of the window.

    D² = Σ explained / (σ²·(1 + 4/depth)),   θ leaves its thresholds where D > k

D is the joint deviation of (θ1, θ2) from healthy in standard deviations: the threshold is the
ellipse of the normal matrix, and the published limits ±k·sd are its half axes. `depth` is the
number of periods in the healthy average, whose own error does not average out.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.decision.kernel_state import (  # fmt: skip
    CONDITION,
    DEVIATION,
    HIGH1,
    HIGH2,
    LONG,
    LOW1,
    LOW2,
    OBSERVABLE,
    SPEED_RMS,
    THETA1,
    THETA2,
    Rules,
    S,
    WatchState,
)
from monitor.estimation import FILL, LENGTH, energy, solve_two, sums
from monitor.reference import (
    APERIODIC,
    FIXED,
    Reference,
)
from rigwatch.wire.kernel import part

STANDING = 2 * LONG
"""Samples at rest after which a rig with an aperiodic drive stands still."""
LEAST_FILL = 8
"""Minimum number of samples to estimate two parameters."""
_APERIODIC_VARIANCE = 9.0
"""Factor for aperiodic drives, for which the residual itself is judged: it peaks at about 3 rms."""


@part(inline="always")
def spread_of_change(ref: Reference) -> float:
    """Standard deviation of the change of the residual, including the healthy average's error."""
    if ref.counts.source == APERIODIC:
        level = max(ref.levels.quick, ref.levels.slow)
        variance = ref.levels.noise**2 + ref.levels.left_share * level
        return np.sqrt((1.0 + _APERIODIC_VARIANCE) * variance)
    return ref.levels.noise * np.sqrt(1.0 + 4.0 / max(ref.counts.depth, 1))


@part(inline="always")
def _stands(ref: Reference, state: WatchState) -> bool:
    """Whether the rig is at rest: the velocity is then what its filter keeps of the motion before.

    A periodic drive has moved it within any window, which spans whole periods.
    """
    length = state.window.place[LENGTH]
    if ref.counts.source == APERIODIC:
        length = min(length, STANDING)
    return state.counts.still >= length


@part(inline="always")
def estimate(spread: float, rules: Rules, ref: Reference, state: WatchState) -> None:
    """Write θ, its limits, D and the observability of friction to `state.held`; `spread` is
    `spread_of_change`.
    """
    held, s = state.held, state.sums
    sums(state.window, s)
    theta1, theta2, condition = solve_two(s)
    speed = np.sqrt(energy(state.energies, S) / max(state.energies.place[FILL], 1))
    held[CONDITION], held[SPEED_RMS] = condition, speed
    moves = speed >= rules.least_velocity and not _stands(ref, state)
    observable = moves and state.window.place[FILL] >= LEAST_FILL
    held[OBSERVABLE] = 1.0 if observable else 0.0
    if not observable:
        held[CONDITION] = 1.0
    if not observable or not condition < rules.worst_condition:
        held[DEVIATION] = 0.0
        return
    determinant = s[0] * s[3] - s[1] * s[1]
    # Standard deviations of the estimates for white noise, from the inverse normal matrix.
    reach1 = rules.factor * spread * np.sqrt(s[3] / determinant)
    reach2 = rules.factor * spread * np.sqrt(s[0] / determinant)
    held[THETA1], held[THETA2] = theta1, theta2
    held[LOW1], held[HIGH1], held[LOW2], held[HIGH2] = -reach1, reach1, -reach2, reach2
    # Energy explained by both terms, which is χ²(2) distributed for a healthy rig.
    held[DEVIATION] = np.sqrt(max(theta1 * s[2] + theta2 * s[4], 0.0)) / spread
    if ref.counts.source == FIXED:
        _judge_by_band(rules, state)


@part()
def _judge_by_band(rules: Rules, state: WatchState) -> None:
    """Test against fixed limits, where the deviation is k; a partly filled window is ignored."""
    held, place = state.held, state.window.place
    held[LOW1], held[HIGH1] = rules.low1, rules.high1
    held[LOW2], held[HIGH2] = rules.low2, rules.high2
    out1 = abs(2.0 * held[THETA1] - rules.low1 - rules.high1) / (rules.high1 - rules.low1)
    out2 = abs(2.0 * held[THETA2] - rules.low2 - rules.high2) / (rules.high2 - rules.low2)
    full = place[FILL] == place[LENGTH]
    held[DEVIATION] = rules.factor * max(out1, out2) if full else 0.0
