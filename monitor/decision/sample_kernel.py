"""Per-sample decision while armed: change of residual, estimates, departure, verdict.

See docs/theory.md 1.4.

    change ─▶ sums and history ─▶ estimates ─▶ departure ─▶ episode ─▶ verdict

Before that, the healthy reference takes the samples until it is armed.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np
from numpy.typing import NDArray

from monitor.decision.departure import departed
from monitor.decision.episode import PLAINLY_HEALTHY, follow
from monitor.decision.estimates import estimate, spread_of_change
from monitor.decision.isolation import HISTORY, store_sample
from monitor.decision.kernel_state import (  # fmt: skip
    ARMED_FLAG,
    CHANGE,
    DEVIATION,
    LEARNT_HERE,
    MODELLED,
    OBSERVABLE,
    RESIDUAL,
    SPEED,
    A,
    Rules,
    S,
    V,
    WatchState,
    X,
    Y,
    clear,
)
from monitor.estimation import FILL, Window, add, push
from monitor.reference import (
    APERIODIC,
    ARMED,
    Reference,
    ReferenceRules,
    follow_level,
    get_to_know,
    is_known,
    learnt_here,
    observe,
    pass_over,
    place_in_period,
    restart,
)
from monitor.signals import (
    ACCELERATION,
    DEAD,
    G1,
    G2,
    GOOD,
    HELD,
    NEW_BOOT,
    POSITION,
    RESTART,
    VELOCITY,
    VOLTAGE,
    Codes,
    fill,
)
from monitor.signals import MODELLED as MODELLED_COLUMN
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel, part


@kernel()
def watch_block(  # noqa: PLR0917
    data: FloatArray,
    code: Codes,
    position_valid: NDArray[np.uint8],
    first: int,
    rules: Rules,
    arming: ReferenceRules,
    ref: Reference,
    state: WatchState,
    out: FloatArray,
) -> None:
    """Process the residual stage's columns from sample `first` on; fills `out`, (OUTPUTS, n)."""
    for k in range(code.size):
        seq = first + k
        # A window across a gap would mix two motions, so everything collected is dropped.
        if code[k] == RESTART or code[k] == NEW_BOOT:
            restart(ref, code[k] == NEW_BOOT)
            clear(state, rules.window)
        good = code[k] == GOOD or code[k] == RESTART or code[k] == NEW_BOOT
        if good and ref.counts.mode != ARMED:
            observe(ref, arming, seq, data[k])
            if ref.counts.mode == ARMED:
                # Only now is the period known, and with it the length of whole-period windows.
                clear(state, _window_length(rules.window, ref, state.window))
        elif good:
            _judge(data[k], seq, position_valid[k], rules, ref, state)
        elif code[k] == HELD and ref.counts.mode == ARMED:
            _skip(state)
        elif code[k] == HELD:
            pass_over(ref)
        _write(data[k], code[k], ref, state, out[:, k])


@part()
def _window_length(wanted: int, ref: Reference, window: Window) -> int:
    """Window of whole periods of the excitation, at least as requested, at most the capacity.

    Without a period it is as long as the history: the model error of a healthy rig varies with the
    drive and averages out only over seconds.
    """
    period = ref.counts.period
    room = window.rows.shape[0]
    if ref.counts.source == APERIODIC:
        return min(room, HISTORY)
    return min(((wanted + period - 1) // period) * period, (room // period) * period)


@part()
def _skip(state: WatchState) -> None:
    """Process a sample that does not count, so that windows keep their length in time."""
    fill(state.row, 0.0)
    fill(state.signals, 0.0)
    push(state.window, state.row)
    add(state.energies, state.signals)
    store_sample(state.history, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if state.counts.episode > 0:
        state.counts.episode += 1


@part(inline="always")
def _judge(  # noqa: PLR0917
    data: FloatArray,
    seq: int,
    position_valid: int,
    rules: Rules,
    ref: Reference,
    state: WatchState,
) -> None:
    """Process one good sample."""
    place = place_in_period(ref, seq)
    if not is_known(ref, place):
        if state.counts.episode == 0 and state.held[DEVIATION] < PLAINLY_HEALTHY * rules.factor:
            get_to_know(ref, place, data)
        _skip(state)
        return
    _take(data, place, position_valid, ref, state)
    spread = spread_of_change(ref)
    # Sums are updated by every sample, the least squares are solved every `hop` samples.
    state.counts.hop += 1
    if state.counts.hop >= rules.hop:
        state.counts.hop = 0
        estimate(spread, rules, ref, state)
    follow(departed(spread, rules, ref, state), seq, place, data, rules, ref, state)


@part(inline="always")
def _take(
    data: FloatArray, place: int, position_valid: int, ref: Reference, state: WatchState
) -> None:
    """Add the sample's changes against the healthy period to sums and history."""
    signals, row, healthy = state.signals, state.row, ref.template
    acceleration = data[ACCELERATION] - healthy[ACCELERATION, place]
    modelled = data[MODELLED_COLUMN] - healthy[MODELLED_COLUMN, place]
    y = acceleration - ref.levels.scale * modelled
    if ref.counts.source == APERIODIC:
        follow_level(ref, ref.levels.scale * modelled)
    signals[Y], signals[A], signals[S] = y, acceleration, data[VELOCITY]
    signals[X] = data[POSITION] - healthy[POSITION, place] if position_valid else 0.0
    signals[V] = data[VOLTAGE] - healthy[VOLTAGE, place]
    add(state.energies, signals)
    row[0], row[1], row[2] = data[G1], data[G2], y
    push(state.window, row)
    rest = _at_rest(data, ref, state)
    _count_still(data[POSITION], rest, ref, state)
    store_sample(
        state.history, y, data[G1], data[G2], data[VELOCITY], rest, signals[V], data[POSITION]
    )
    state.held[CHANGE] = y


@part(inline="always")
def _at_rest(data: FloatArray, ref: Reference, state: WatchState) -> float:
    """1.0 if position and acceleration are at rest over four samples.

    The position must be within its noise (six standard deviations between the largest and the
    smallest of four), the acceleration within ten, and small: the rest is the piezo's high-pass.
    """
    recent = state.recent
    for n in range(3):
        recent[n], recent[n + 4] = recent[n + 1], recent[n + 5]
    recent[3], recent[7] = data[POSITION], data[ACCELERATION]
    spread = max(recent[0], recent[1], recent[2], recent[3])
    spread -= min(recent[0], recent[1], recent[2], recent[3])
    shaken = max(recent[4], recent[5], recent[6], recent[7])
    shaken -= min(recent[4], recent[5], recent[6], recent[7])
    weak = abs(recent[7]) < 0.15 * ref.levels.acceleration_swing + 5.0 * ref.levels.noise
    still = spread < 6.0 * ref.levels.position_noise and shaken < 10.0 * ref.levels.noise and weak
    return 1.0 if still else 0.0


@part(inline="always")
def _count_still(position: float, rest: float, ref: Reference, state: WatchState) -> None:
    """Count the samples at rest in one place, within ten standard deviations of the position."""
    place = state.recent
    lowest, highest = min(place[8], position), max(place[9], position)
    if rest > 0.0 and highest - lowest < 10.0 * ref.levels.position_noise:
        state.counts.still += 1
        place[8], place[9] = lowest, highest
    else:
        state.counts.still = 0
        place[8] = place[9] = position


@part(inline="always")
def _write(data: FloatArray, code: int, ref: Reference, state: WatchState, out: FloatArray) -> None:
    # Estimates hold their last value between solutions; the residual is that of this sample.
    for i in range(out.size):
        out[i] = state.held[i]
    scale = ref.levels.scale
    out[MODELLED] = scale * data[MODELLED_COLUMN]
    out[RESIDUAL] = data[ACCELERATION] - scale * data[MODELLED_COLUMN]
    out[SPEED] = data[VELOCITY]
    armed = ref.counts.mode == ARMED and code != DEAD and state.energies.place[FILL] > 0
    out[ARMED_FLAG] = 1.0 if armed else 0.0
    out[LEARNT_HERE] = learnt_here(ref) if armed else 0.0
    if not armed:
        out[DEVIATION] = 0.0
        out[OBSERVABLE] = 0.0
