"""Departure test: estimates, change of the residual over 8 and 64 samples, position and voltage.

Position and voltage are compared with the healthy period: a fault of one sensor shows only in its
own channel, and not every fault shows in the estimates.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.decision.kernel_state import (
    DEVIATION,
    LONG,
    MOVED_VOLTAGE,
    SHORT,
    Rules,
    V,
    WatchState,
    X,
    Y,
)
from monitor.estimation import FILL, Energies, energy, recent_energy
from monitor.reference import (
    APERIODIC,
    FIXED,
    Reference,
)
from rigwatch.wire.kernel import part

_NOISES = 6.0
"""Rms over a window that noise alone does not exceed, in standard deviations of the channel."""
_CLEARLY = 1.0 - 1e-9
"""Share of a value below which another one is smaller whatever the rounding of both."""


@part(inline="always")
def moved(energies: Energies, signal: int, count: int) -> float:
    """Root mean square of the newest `count` samples."""
    if count >= energies.rows.shape[0]:
        return np.sqrt(energy(energies, signal) / max(energies.place[FILL], 1))
    return np.sqrt(recent_energy(energies, signal, count) / max(count, 1))


@part(inline="always")
def position_limit(rules: Rules, ref: Reference) -> float:
    """Allowed rms deviation of the position from its healthy period [m]."""
    return max(
        _NOISES * ref.levels.position_noise, rules.position_floor * ref.levels.position_swing
    )


@part(inline="always")
def voltage_limit(rules: Rules, ref: Reference) -> float:
    """Allowed rms deviation of the voltage from its healthy period [V]."""
    return max(_NOISES * ref.levels.voltage_noise, rules.voltage_floor * ref.levels.swing)


@part(inline="always")
def departed(spread: float, rules: Rules, ref: Reference, state: WatchState) -> bool:
    """Whether any statistic exceeds its limit; stores the largest as deviation, in units of k.

    Args:
        spread: `spread_of_change` [m/s^2].
        rules, ref, state: of the rig.
    """
    held, energies = state.held, state.energies
    if ref.counts.source == FIXED:
        return held[DEVIATION] > rules.factor
    variance = spread**2
    # Roots and divisions take most of a sample's time: of two squares the larger one has the larger
    # root, and a position well within its limit does not need one.
    square = recent_energy(energies, Y, SHORT) / variance / rules.limit_8
    if energies.place[FILL] >= LONG:
        square = max(square, energy(energies, Y) / variance / rules.limit_64)
    largest = max(held[DEVIATION] / rules.factor, np.sqrt(square))
    if ref.counts.source != APERIODIC:
        limit = position_limit(rules, ref)
        reach = _CLEARLY * largest * limit
        if energy(energies, X) > reach * reach * energies.place[FILL]:
            largest = max(largest, moved(energies, X, LONG) / limit)
        voltage = moved(energies, V, LONG)
        held[MOVED_VOLTAGE] = voltage / max(ref.levels.swing, 1e-12)
        largest = max(largest, voltage / voltage_limit(rules, ref))
    held[DEVIATION] = largest * rules.factor
    return largest > 1.0
