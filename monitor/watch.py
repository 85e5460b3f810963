"""Sample by sample: change of the residual, estimates, departure, verdict (theory 1.4).

    D² = Σ explained / (σ²·(1 + 4/depth)),   θ leaves its thresholds where D > k

D is how far (θ1, θ2) lies from healthy in standard deviations, both taken together: the thresholds
are the ellipse that the normal matrix gives, and the printed limits ±k·sd its half axes. `depth`
is the number of periods in the healthy average, whose own error does not average out. Beside the
estimates stand the change's energy over 8 and 64 samples, and how far position and voltage have
moved from the healthy period: a fault of one sensor shows in one channel alone.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from monitor.admission import DEAD, GOOD, HELD, NEW_BOOT, RESTART, Codes
from monitor.energies import Energies, add, energy, recent_energy, restart_energies
from monitor.isolation import HISTORY, History, remember, swing_of_voltage_change, weigh
from monitor.reference import (
    ACCELERATION_SWING,
    APERIODIC,
    ARMED,
    CYCLE,
    DEPTH,
    FIXED,
    MODE,
    NOISE,
    PERIOD,
    POSITION_NOISE,
    POSITION_SWING,
    SCALE,
    SOURCE,
    SWING,
    VOLTAGE_NOISE,
    Reference,
    ReferenceRules,
    observe,
    place_in_period,
    refine,
    restart,
)
from monitor.window import FILL, LENGTH, Window, push, restart_window, solve_two, sums
from rigwatch.physics.transfer_function import FloatArray

NO_VERDICT, FRICTION, OTHER, STICKING, NEW_EXCITATION = 0, 1, 2, 3, 4

(
    MODELLED, RESIDUAL, CHANGE, SPEED, THETA1, THETA2, LOW1, HIGH1, LOW2, HIGH2,
    OBSERVABLE, ARMED_FLAG, DEVIATION, EXPLAINED, SHARE, RHO, REST, VERDICT, CONDITION,
    MOVED_VOLTAGE, SPEED_RMS, TOGETHER,
) = range(22)  # fmt: skip
OUTPUTS = 22

_SINCE, _QUIET, _AGREED, _HOP, _EXCITED = range(5)
_Y, _X, _V, _A, _S = range(5)
_LOOKS_AT_NEW_EXCITATION = 32
"""Looks, four samples apart, after which another excitation is taken for granted and learnt."""


class Rules(NamedTuple):
    """Everything the kernel decides by; see `limits.py` for where the figures come from."""

    window: int
    hop: int
    factor: float
    limit_8: float
    limit_64: float
    least_velocity: float
    worst_condition: float
    position_floor: float
    voltage_floor: float
    low1: float
    high1: float
    low2: float
    high2: float


class WatchState(NamedTuple):
    """All that is carried from sample to sample."""

    window: Window
    energies: Energies
    history: History
    number: NDArray[np.int64]
    held: FloatArray
    recent: FloatArray
    scratch: FloatArray


@njit(cache=True)
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
    """Take the residual stage's columns for samples `first`, `first` + 1, … and fill `out`, shape
    (n, OUTPUTS).
    """
    row = np.empty(4)
    for k in range(code.size):
        seq = first + k
        if code[k] == RESTART or code[k] == NEW_BOOT:
            restart(ref, code[k] == NEW_BOOT)
            _forget(state, rules.window)
        good = code[k] == GOOD or code[k] == RESTART or code[k] == NEW_BOOT
        if good:
            row[0], row[1], row[2], row[3] = data[k, 0], data[k, 1], data[k, 2], data[k, 3]
            if ref.number[MODE] != ARMED:
                observe(ref, arming, seq, row)
                if ref.number[MODE] == ARMED:
                    _forget(state, _window_length(rules.window, ref, state.window))
            else:
                _judge(data[k], row, seq, position_valid[k], rules, ref, state)
        elif code[k] == HELD and ref.number[MODE] == ARMED:
            _skip(state)
        _write(data[k], code[k], ref, state, out[k])


@njit(cache=True)
def _window_length(wanted: int, ref: Reference, window: Window) -> int:
    """Whole periods of the excitation, at least what was wanted, at most what there is room for."""
    period = ref.number[PERIOD]
    room = window.rows.shape[0]
    return min(((wanted + period - 1) // period) * period, (room // period) * period)


@njit(cache=True)
def _forget(state: WatchState, length: int) -> None:
    restart_window(state.window, length)
    restart_energies(state.energies)
    state.history.rows[:, :] = 0.0
    state.number[:] = 0
    state.held[:] = 0.0
    state.recent[:] = 0.0


@njit(cache=True)
def _skip(state: WatchState) -> None:
    """A sample that counts in nothing, so that the windows stay stretches of time."""
    push(state.window, np.zeros(3))
    add(state.energies, np.zeros(5))
    remember(state.history, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if state.number[_SINCE] > 0:
        state.number[_SINCE] += 1


@njit(cache=True, inline="always")
def _judge(  # noqa: PLR0917
    data: FloatArray,
    row: FloatArray,
    seq: int,
    position_valid: int,
    rules: Rules,
    ref: Reference,
    state: WatchState,
) -> None:
    """One good sample while armed."""
    place = place_in_period(ref, seq)
    acceleration = row[2] - ref.template[2, place]
    y = acceleration - ref.value[SCALE] * (row[3] - ref.template[3, place])
    signals, regressors = state.scratch[0], state.scratch[1]
    signals[_Y], signals[_A], signals[_S] = y, acceleration, data[4]
    signals[_X] = row[1] - ref.template[1, place] if position_valid else 0.0
    signals[_V] = row[0] - ref.template[0, place]
    add(state.energies, signals)
    regressors[0], regressors[1], regressors[2] = data[5], data[6], y
    push(state.window, regressors)
    rest = _at_rest(row, ref, state)
    remember(state.history, y, data[5], data[6], data[4], rest, signals[_V])
    state.held[CHANGE] = y
    state.number[_HOP] += 1
    if state.number[_HOP] >= rules.hop:
        state.number[_HOP] = 0
        _estimate(rules, ref, state)
    departed = _departure(rules, ref, state)
    _follow(departed, seq, place, row, rules, ref, state)


@njit(cache=True, inline="always")
def _at_rest(row: FloatArray, ref: Reference, state: WatchState) -> float:
    """1.0 where position and acceleration have stood still over four samples."""
    recent = state.recent
    for n in range(3):
        recent[n], recent[n + 4] = recent[n + 1], recent[n + 5]
    recent[3], recent[7] = row[1], row[2]
    spread = max(recent[0], recent[1], recent[2], recent[3])
    spread -= min(recent[0], recent[1], recent[2], recent[3])
    shaken = max(recent[4], recent[5], recent[6], recent[7])
    shaken -= min(recent[4], recent[5], recent[6], recent[7])
    weak = abs(recent[7]) < 0.15 * ref.value[ACCELERATION_SWING] + 5.0 * ref.value[NOISE]
    still = spread < 6.0 * ref.value[POSITION_NOISE] and shaken < 10.0 * ref.value[NOISE] and weak
    return 1.0 if still else 0.0


@njit(cache=True, inline="always")
def _spread(ref: Reference) -> float:
    """Standard deviation of the change of the residual, error of the healthy average included."""
    extra = 9.0 if ref.number[SOURCE] == APERIODIC else 4.0 / max(ref.number[DEPTH], 1)
    return ref.value[NOISE] * np.sqrt(1.0 + extra)


@njit(cache=True, inline="always")
def _estimate(rules: Rules, ref: Reference, state: WatchState) -> None:
    """θ, its limits, D and whether friction can be seen at all."""
    held, s = state.held, state.scratch[2]
    sums(state.window, s)
    theta1, theta2, condition = solve_two(s)
    speed = np.sqrt(energy(state.energies, _S) / max(state.energies.place[FILL], 1))
    held[CONDITION], held[SPEED_RMS] = condition, speed
    observable = speed >= rules.least_velocity and state.window.place[FILL] >= 8
    held[OBSERVABLE] = 1.0 if observable else 0.0
    if not observable:
        held[CONDITION] = 1.0
    if not observable or not condition < rules.worst_condition:
        held[DEVIATION] = 0.0
        return
    spread = _spread(ref)
    determinant = s[0] * s[3] - s[1] * s[1]
    reach1 = rules.factor * spread * np.sqrt(s[3] / determinant)
    reach2 = rules.factor * spread * np.sqrt(s[0] / determinant)
    held[THETA1], held[THETA2] = theta1, theta2
    held[LOW1], held[HIGH1], held[LOW2], held[HIGH2] = -reach1, reach1, -reach2, reach2
    held[DEVIATION] = np.sqrt(max(theta1 * s[2] + theta2 * s[4], 0.0)) / spread
    if ref.number[SOURCE] == FIXED:
        _judge_by_band(rules, state)


@njit(cache=True)
def _judge_by_band(rules: Rules, state: WatchState) -> None:
    """Fixed limits; the deviation is k at a limit. A window that is not full yet has no say."""
    held, place = state.held, state.window.place
    held[LOW1], held[HIGH1], held[LOW2], held[HIGH2] = (
        rules.low1, rules.high1, rules.low2, rules.high2,
    )  # fmt: skip
    out1 = abs(2.0 * held[THETA1] - rules.low1 - rules.high1) / (rules.high1 - rules.low1)
    out2 = abs(2.0 * held[THETA2] - rules.low2 - rules.high2) / (rules.high2 - rules.low2)
    full = place[FILL] == place[LENGTH]
    held[DEVIATION] = rules.factor * max(out1, out2) if full else 0.0


@njit(cache=True, inline="always")
def _moved(energies: Energies, signal: int, count: int) -> float:
    """Root mean square of the newest `count` samples."""
    if count >= energies.rows.shape[0]:
        return np.sqrt(energy(energies, signal) / max(energies.place[FILL], 1))
    return np.sqrt(recent_energy(energies, signal, count) / max(count, 1))


@njit(cache=True, inline="always")
def _position_limit(rules: Rules, ref: Reference) -> float:
    return max(6.0 * ref.value[POSITION_NOISE], rules.position_floor * ref.value[POSITION_SWING])


@njit(cache=True, inline="always")
def _voltage_limit(rules: Rules, ref: Reference) -> float:
    return max(6.0 * ref.value[VOLTAGE_NOISE], rules.voltage_floor * ref.value[SWING])


@njit(cache=True, inline="always")
def _departure(rules: Rules, ref: Reference, state: WatchState) -> bool:
    """Whether anything has left its limits; the largest of all goes into the deviation, in units
    of k.
    """
    held, energies = state.held, state.energies
    if ref.number[SOURCE] == FIXED:
        return held[DEVIATION] > rules.factor
    variance = _spread(ref) ** 2
    largest = held[DEVIATION] / rules.factor
    largest = max(largest, np.sqrt(recent_energy(energies, _Y, 8) / variance / rules.limit_8))
    if energies.place[FILL] >= 64:
        largest = max(largest, np.sqrt(energy(energies, _Y) / variance / rules.limit_64))
    if ref.number[SOURCE] != APERIODIC:
        largest = max(largest, _moved(energies, _X, 64) / _position_limit(rules, ref))
        voltage = _moved(energies, _V, 64)
        held[MOVED_VOLTAGE] = voltage / max(ref.value[SWING], 1e-12)
        largest = max(largest, voltage / _voltage_limit(rules, ref))
    held[DEVIATION] = largest * rules.factor
    return largest > 1.0


@njit(cache=True, inline="always")
def _follow(  # noqa: PLR0917
    departed: bool,
    seq: int,
    place: int,
    row: FloatArray,
    rules: Rules,
    ref: Reference,
    state: WatchState,
) -> None:
    """Onset and end of an episode, its verdict, and the healthy average between episodes."""
    number, held = state.number, state.held
    if departed:
        number[_QUIET] = 0
        number[_SINCE] += 1
    elif number[_SINCE] > 0:
        number[_QUIET] += 1
        number[_SINCE] += 1
        if number[_QUIET] >= 64:
            number[_SINCE] = number[_QUIET] = 0
            held[VERDICT] = NO_VERDICT
            held[EXPLAINED] = held[SHARE] = held[RHO] = held[REST] = 0.0
    if number[_SINCE] == 0:
        if held[DEVIATION] < 0.6 * rules.factor:
            refine(ref, place, row)
    elif number[_SINCE] >= 12 and seq % 4 == 0:
        _decide(seq, rules, ref, state)
        number[_EXCITED] = number[_EXCITED] + 1 if held[VERDICT] == NEW_EXCITATION else 0
        if number[_EXCITED] >= _LOOKS_AT_NEW_EXCITATION:
            restart(ref, True)
            _forget(state, rules.window)


@njit(cache=True)
def _decide(seq: int, rules: Rules, ref: Reference, state: WatchState) -> None:
    """Which channels have moved, what the residual follows, and what that makes it."""
    held, energies, since = state.held, state.energies, state.number[_SINCE]
    if ref.number[SOURCE] == FIXED:
        held[VERDICT] = FRICTION if held[THETA1] > rules.high1 else OTHER
        return
    count = min(since, 64)
    spread = _spread(ref)
    moved_v = _moved(energies, _V, count)
    moved_x = _moved(energies, _X, count) > _position_limit(rules, ref)
    moved_a = _moved(energies, _A, count) > max(3.0 * spread, 0.002 * ref.value[ACCELERATION_SWING])
    span = max(32, min(ref.number[CYCLE], 256))
    evidence = weigh(state.history, ref, seq, min(since, HISTORY), min(since, 2 * span))
    held[EXPLAINED], held[SHARE] = evidence.explained, evidence.share
    held[RHO], held[REST] = evidence.rho, evidence.rest
    held[TOGETHER] = evidence.together
    held[VERDICT] = _verdict(
        held[VERDICT], since, span, moved_v, moved_x, moved_a, rules, ref, state, evidence, spread
    )


@njit(cache=True)
def _verdict(before, since, span, moved_v, moved_x, moved_a, rules, ref, state, evidence, spread):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """The verdict after one more look; dry friction, once found, stays until the episode ends."""
    limit_v = _voltage_limit(rules, ref)
    if moved_v > limit_v and not moved_a:
        return OTHER
    swing_v = swing_of_voltage_change(state.history, min(since, 64))
    if swing_v > 0.1 * ref.value[SWING] and moved_a:
        return NEW_EXCITATION
    jump_seen = evidence.share > 0.003 and evidence.jump > 30.0 * spread**2 and evidence.dry > 0.2
    certain = jump_seen and evidence.rho > 0.9 and evidence.explained > 0.95
    settled = since >= 3 * span
    jumps = jump_seen and evidence.rho > 0.35 and evidence.explained > 0.6 and settled
    follows = (
        evidence.explained > 0.93
        and evidence.dry > 0.3
        and evidence.share > 0.001
        and evidence.rho > 0.2
        and settled
    )
    thin = evidence.share > 0.3 and evidence.rho > 0.6 and settled
    slips = evidence.rest > 0.04 and evidence.together > 0.7 and evidence.rho > -0.5
    slips = slips and since >= span and before != OTHER
    sure = moved_x or evidence.share > 0.1
    spike = evidence.peak > 0.5
    friction = moved_a and sure and not spike and (certain or jumps or follows or thin or slips)
    state.number[_AGREED] = state.number[_AGREED] + 1 if friction else 0
    if before in (FRICTION, STICKING) or state.number[_AGREED] >= 3:
        return STICKING if evidence.rest >= 0.5 and moved_a else FRICTION
    alone = moved_x and not moved_a
    if since >= 4 * span + 64 or (settled and alone) or (since >= span and spike):
        return OTHER
    return before


@njit(cache=True, inline="always")
def _write(data: FloatArray, code: int, ref: Reference, state: WatchState, out: FloatArray) -> None:
    for i in range(out.size):
        out[i] = state.held[i]
    scale = ref.value[SCALE]
    out[MODELLED] = scale * data[3]
    out[RESIDUAL] = data[2] - scale * data[3]
    out[SPEED] = data[4]
    armed = ref.number[MODE] == ARMED and code != DEAD and state.energies.place[FILL] > 0
    out[ARMED_FLAG] = 1.0 if armed else 0.0
    if not armed:
        out[DEVIATION] = 0.0
        out[OBSERVABLE] = 0.0
