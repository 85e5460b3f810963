"""Episodes: from a departure until all statistics are quiet, with an isolation test every four
samples. Between episodes the healthy average is extended.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from monitor.decision.departure import moved, position_limit, voltage_limit
from monitor.decision.estimates import spread_of_change
from monitor.decision.isolation import HISTORY, evidence_of, swing_of_voltage_change
from monitor.decision.isolation_verdict import Seen, verdict
from monitor.decision.kernel_state import (  # fmt: skip
    DEVIATION,
    EXPLAINED,
    FRICTION,
    LONG,
    NEW_EXCITATION,
    NO_VERDICT,
    OTHER,
    REST,
    RHO,
    SHARE,
    THETA1,
    TOGETHER,
    VERDICT,
    A,
    Rules,
    V,
    WatchState,
    X,
    clear,
)
from monitor.reference import (
    APERIODIC,
    FIXED,
    Reference,
    refine,
    restart,
)
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

ENDS_AFTER = 64
"""Number of quiet samples that end an episode."""
FIRST_LOOK, LOOK_EVERY = 12, 4
"""Samples from the departure to the first isolation test, and between tests."""
PLAINLY_HEALTHY = 0.6
"""Share of the threshold below which a sample is added to the healthy average."""
LOOKS_AT_NEW_EXCITATION = 32
"""Number of tests after which another excitation is accepted and its reference learned."""
LOUDER = 2.0
"""Ratio of an aperiodic voltage's amplitude to that of the learned stretch above which it counts as
another excitation. No fault is named then: with the model error of an aperiodic motion, a dead band
resembles dry friction, and heavy friction resembles any fault.
"""
SHORTEST_CYCLE, LONGEST_CYCLE = 32, 256
"""Limits of the number of samples judged: evidence needs some, a slow drive must not delay it."""


@part(inline="always")
def follow(  # noqa: PLR0917
    out: bool,
    seq: int,
    place: int,
    row: FloatArray,
    rules: Rules,
    ref: Reference,
    state: WatchState,
) -> None:
    """Process sample `seq`, at `place` of the period; `out`: whether it exceeds its limits."""
    counts = state.counts
    _count(out, state)
    if counts.episode == 0:
        # A wide margin: a fault that grows slowly must not become part of the healthy average.
        if state.held[DEVIATION] < PLAINLY_HEALTHY * rules.factor:
            refine(ref, place, row)
    elif counts.episode >= FIRST_LOOK and seq % LOOK_EVERY == 0:
        _look(seq, rules, ref, state)
        excited = state.held[VERDICT] == NEW_EXCITATION
        counts.excited = counts.excited + 1 if excited else 0
        if counts.excited >= LOOKS_AT_NEW_EXCITATION:
            restart(ref, True)
            clear(state, rules.window)


@part(inline="always")
def _count(out: bool, state: WatchState) -> None:
    """Begin, continue or end the episode."""
    counts, held = state.counts, state.held
    if out:
        counts.quiet = 0
        counts.episode += 1
    elif counts.episode > 0:
        counts.quiet += 1
        counts.episode += 1
        # The statistics of a fault pass through zero; only a long quiet time ends the episode.
        if counts.quiet >= ENDS_AFTER:
            counts.episode = counts.quiet = 0
            held[VERDICT] = NO_VERDICT
            held[EXPLAINED] = held[SHARE] = held[RHO] = held[REST] = 0.0


@part()
def _look(seq: int, rules: Rules, ref: Reference, state: WatchState) -> None:
    """Evaluate the evidence since the departure and update the verdict."""
    held, since = state.held, state.counts.episode
    # Fixed limits come without a healthy period, so no rival can be compared: θ1 decides.
    if ref.counts.source == FIXED:
        held[VERDICT] = FRICTION if held[THETA1] > rules.high1 else OTHER
        return
    if ref.counts.source == APERIODIC:
        louder = swing_of_voltage_change(state.history, HISTORY) > LOUDER * ref.levels.swing
        held[VERDICT] = NEW_EXCITATION if louder else NO_VERDICT
        return
    cycle = max(SHORTEST_CYCLE, min(ref.counts.cycle, LONGEST_CYCLE))
    evidence = evidence_of(state.history, ref, seq, min(since, HISTORY), min(since, 2 * cycle))
    held[EXPLAINED], held[SHARE] = evidence.explained, evidence.share
    held[RHO], held[REST] = evidence.rho, evidence.rest
    held[TOGETHER] = evidence.together
    held[VERDICT] = verdict(_seen(since, cycle, rules, ref, state), evidence, state)


@part()
def _seen(since: int, cycle: int, rules: Rules, ref: Reference, state: WatchState) -> Seen:
    """Channels that have deviated since the departure."""
    energies, count = state.energies, min(since, LONG)
    spread = spread_of_change(ref)
    acceleration_limit = max(3.0 * spread, 0.002 * ref.levels.acceleration_swing)
    return Seen(
        state.held[VERDICT],
        since,
        cycle,
        moved(energies, V, count) > voltage_limit(rules, ref),
        moved(energies, X, count) > position_limit(rules, ref),
        moved(energies, A, count) > acceleration_limit,
        swing_of_voltage_change(state.history, count) / max(ref.levels.swing, 1e-30),
        spread,
    )
