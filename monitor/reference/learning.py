"""The healthy rig under the present excitation: one period of each signal, and how much they
scatter about it.

A linear model leaves about a tenth of the acceleration of a pneumatic rig unexplained. That part
is no noise: it repeats with the excitation. Its average over whole periods is subtracted, so that
what remains is the change of the residual

    y(φ) = [ a(φ) - s·am(φ) ] - [ A(φ) - s·AM(φ) ],   s = Σ A·AM / Σ AM²

with φ the place in the period, A and AM the averages of measured and modelled acceleration, s the
amplitude scale. The average comes from the model file where that holds this very excitation, else
from the first second of the run, and it goes on growing while the rig is plainly healthy.

An excitation that does not repeat has no such average; see `aperiodic.py`.

    SETTLING ──settled, period found──▶ LEARNING ──enough periods, quiet──▶ ARMED
        ▲    ──a reference of the model file fits and agrees─────────────────▲
        └─────────── another excitation, or a new boot ────────────────────────┘
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np
from numba import njit

from monitor.reference.aperiodic import learn_aperiodic
from monitor.reference.reference_state import (
    ACCELERATION_SWING,
    ANCHOR,
    APERIODIC,
    ARMED,
    CYCLE,
    DEPTH,
    FIXED,
    FROM_MODEL,
    FROM_RUN,
    LEARNING,
    LEARNT,
    LONGEST_AVERAGE,
    MODE,
    NO_REFERENCE,
    NOISE,
    PERIOD,
    POSITION_NOISE,
    POSITION_SWING,
    RESUMING,
    RING_FILL,
    RING_HEAD,
    SCALE,
    SETTLING,
    SINCE,
    SOURCE,
    SWING,
    VOLTAGE_NOISE,
    Reference,
    ReferenceRules,
)
from rigwatch.wire.arrays import FloatArray


@njit()
def restart(ref: Reference, new_boot: bool) -> None:
    """Filters have been reset: settle again, and forget the reference where its phase is lost."""
    ref.number[SINCE] = 0
    ref.number[RING_FILL] = 0
    ref.number[RING_HEAD] = 0
    ref.number[LEARNT] = 0
    keeps = ref.number[MODE] == ARMED or ref.number[MODE] == RESUMING
    ref.number[MODE] = RESUMING if keeps and not new_boot else SETTLING
    if ref.number[MODE] == SETTLING:
        ref.number[SOURCE] = NO_REFERENCE


@njit(inline="always")
def place_in_period(ref: Reference, seq: int) -> int:
    """φ of sample number `seq`."""
    return (seq - ref.number[ANCHOR]) % ref.number[PERIOD]


@njit(inline="always")
def learnt_here(ref: Reference) -> int:
    """Samples of this run that the reference rests on, 0 where the model file holds it."""
    own = ref.number[SOURCE] == FROM_RUN or ref.number[SOURCE] == APERIODIC
    return ref.number[DEPTH] * ref.number[PERIOD] if own else 0


@njit()
def observe(ref: Reference, rules: ReferenceRules, seq: int, row: FloatArray) -> None:
    """Take one good sample (V, x, a, am) before the reference is armed; may arm it."""
    number = ref.number
    number[SINCE] += 1
    _remember(ref, row[0])
    if number[MODE] == RESUMING:
        if number[SINCE] >= rules.settle:
            number[MODE] = ARMED
    elif number[MODE] == SETTLING and rules.fixed:
        if number[SINCE] >= rules.settle:
            _arm_fixed(ref, rules)
    elif number[MODE] == SETTLING:
        if number[SINCE] >= rules.settle and number[SINCE] % 16 == 0:
            _look_for_period(ref, rules, seq)
    elif number[MODE] == LEARNING:
        _learn(ref, rules, seq, row)


@njit()
def _arm_fixed(ref: Reference, rules: ReferenceRules) -> None:
    """No healthy average: the residual is friction itself, its limits stand in the model file."""
    ref.template[:, :] = 0.0
    ref.number[PERIOD], ref.number[ANCHOR], ref.number[DEPTH] = 1, 0, LONGEST_AVERAGE
    ref.number[SOURCE], ref.number[MODE] = FIXED, ARMED
    ref.value[SCALE], ref.value[NOISE] = 1.0, rules.residual_noise


@njit()
def _remember(ref: Reference, voltage: float) -> None:
    size = ref.ring.size
    ref.ring[ref.number[RING_HEAD]] = voltage
    ref.number[RING_HEAD] = (ref.number[RING_HEAD] + 1) % size
    ref.number[RING_FILL] = min(ref.number[RING_FILL] + 1, size)


@njit()
def _past(ref: Reference, ago: int) -> float:
    """Voltage `ago` samples before the newest."""
    return ref.ring[(ref.number[RING_HEAD] - 1 - ago) % ref.ring.size]


@njit()
def _swing(ref: Reference, count: int) -> float:
    mean = 0.0
    for n in range(count):
        mean += _past(ref, n)
    mean /= count
    square = 0.0
    for n in range(count):
        square += (_past(ref, n) - mean) ** 2
    return np.sqrt(square / count)


@njit()
def _look_for_period(ref: Reference, rules: ReferenceRules, seq: int) -> None:
    count = ref.number[RING_FILL]
    swing = _swing(ref, count)
    if swing < 10.0 * rules.voltage_noise:
        return
    tolerance = (0.006 * swing) ** 2 + (3.0 * rules.voltage_noise) ** 2
    for period in range(4, min(count // 2, rules.longest_period) + 1):
        if _repeats(ref, period, count - period, tolerance):
            _found(ref, rules, seq, period, swing)
            return
    if count >= 2 * rules.longest_period:
        _found(ref, rules, seq, 1, swing)
        ref.number[SOURCE] = APERIODIC


@njit()
def _repeats(ref: Reference, period: int, count: int, tolerance: float) -> bool:
    """Whether the voltage repeats after `period`; gives up as soon as it cannot."""
    total = 0.0
    for n in range(count):
        total += (_past(ref, n) - _past(ref, n + period)) ** 2
        if total > tolerance * count:
            return False
    return True


@njit()
def _found(ref: Reference, rules: ReferenceRules, seq: int, period: int, swing: float) -> None:
    number, value = ref.number, ref.value
    number[PERIOD], number[ANCHOR] = period, seq + 1
    number[LEARNT], number[DEPTH] = 0, 0
    value[SWING] = swing
    value[NOISE] = rules.residual_noise
    value[POSITION_NOISE] = rules.position_noise
    value[VOLTAGE_NOISE] = rules.voltage_noise
    ref.sums[:, :] = 0.0
    ref.products[:] = 0.0
    number[MODE] = LEARNING
    number[SOURCE] = FROM_RUN
    for index in range(ref.known_period.size):
        if ref.known_period[index] == period and period > 1:
            turn = _turn(ref, index, period, swing)
            if turn >= 0:
                _take_known(ref, index, period, turn, seq)
                return


@njit()
def _turn(ref: Reference, index: int, period: int, swing: float) -> int:
    """Place in the known period that the newest voltage belongs to, -1 where it is another
    excitation.
    """
    best, best_turn = (0.02 * swing) ** 2 * period, -1
    for turn in range(period):
        total = 0.0
        for n in range(period):
            total += (_past(ref, n) - ref.known[index, 0, (turn - n) % period]) ** 2
            if total >= best:
                break
        if total < best:
            best, best_turn = total, turn
    return best_turn


@njit()
def _take_known(ref: Reference, index: int, period: int, turn: int, seq: int) -> None:
    """The model file's reference holds for this run: no learning, and a fault from the start
    shows.
    """
    for row in range(4):
        for place in range(period):
            ref.template[row, place] = ref.known[index, row, place]
    ref.number[ANCHOR] = seq - turn
    ref.number[DEPTH] = ref.known_depth[index]
    ref.value[SCALE] = ref.known_scale[index]
    ref.number[SOURCE] = FROM_MODEL
    _measure_swings(ref)
    ref.number[MODE] = ARMED


@njit()
def _learn(ref: Reference, rules: ReferenceRules, seq: int, row: FloatArray) -> None:
    number, period = ref.number, ref.number[PERIOD]
    if period == 1:
        learn_aperiodic(ref, rules, row)
        return
    place = place_in_period(ref, seq)
    for i in range(4):
        ref.sums[i, place] += row[i]
    ref.products[0] += row[2] * row[2]
    ref.products[1] += row[2] * row[3]
    ref.products[2] += row[3] * row[3]
    ref.products[3] += row[1] * row[1]
    ref.products[4] += row[0] * row[0]
    number[LEARNT] += 1
    wanted = max(4, (rules.learn + period - 1) // period) * period
    if number[LEARNT] >= wanted:
        _finish_learning(ref, rules, wanted // period)


@njit()
def _finish_learning(ref: Reference, rules: ReferenceRules, depth: int) -> None:
    """Averages, amplitude scale and scatter; start over where the scatter says that the rig has
    not settled.
    """
    number, value, period = ref.number, ref.value, ref.number[PERIOD]
    for i in range(4):
        for place in range(period):
            ref.template[i, place] = ref.sums[i, place] / depth
    number[DEPTH] = depth
    aa = am = mm = xx = vv = 0.0
    for place in range(period):
        aa += ref.template[2, place] ** 2
        am += ref.template[2, place] * ref.template[3, place]
        mm += ref.template[3, place] ** 2
        xx += ref.template[1, place] ** 2
        vv += ref.template[0, place] ** 2
    scale = am / mm if mm > 0.0 else 0.0
    freedom = period * (depth - 1)
    p = ref.products
    scatter = (p[0] - depth * aa) - 2.0 * scale * (p[1] - depth * am)
    scatter += scale**2 * (p[2] - depth * mm)
    noise = np.sqrt(max(scatter, 0.0) / freedom)
    value[SCALE] = scale
    value[NOISE] = max(noise, rules.residual_noise)
    value[POSITION_NOISE] = max(
        np.sqrt(max(p[3] - depth * xx, 0.0) / freedom), rules.position_noise
    )
    value[VOLTAGE_NOISE] = max(np.sqrt(max(p[4] - depth * vv, 0.0) / freedom), rules.voltage_noise)
    _measure_swings(ref)
    quiet = noise <= 1.5 * rules.residual_noise
    if quiet:
        number[MODE] = ARMED
    else:
        number[LEARNT] = 0
        ref.sums[:, :] = 0.0
        ref.products[:] = 0.0


@njit()
def _measure_swings(ref: Reference) -> None:
    period = ref.number[PERIOD]
    for i, place in ((0, SWING), (1, POSITION_SWING), (2, ACCELERATION_SWING)):
        mean = 0.0
        for k in range(period):
            mean += ref.template[i, k] / period
        square = 0.0
        for k in range(period):
            square += (ref.template[i, k] - mean) ** 2 / period
        ref.value[place] = np.sqrt(square)
    ref.number[CYCLE] = period // _turns(ref)


@njit()
def _turns(ref: Reference) -> int:
    """How often the mass goes to and fro within one period of the samples, at least once: an
    excitation of 5 Hz repeats after 256 samples and has five cycles in them.
    """
    period, swing = ref.number[PERIOD], ref.value[POSITION_SWING]
    mean = 0.0
    for k in range(period):
        mean += ref.template[1, k] / period
    turns, side = 0, 0
    for k in range(2 * period):
        off = ref.template[1, k % period] - mean
        if abs(off) > 0.3 * swing:
            now = 1 if off > 0.0 else -1
            if k >= period and side < 0 < now:
                turns += 1
            side = now
    return max(turns, 1)


@njit(inline="always")
def refine(ref: Reference, place: int, row: FloatArray) -> None:
    """Let one plainly healthy sample into the average, while that is still growing."""
    period = ref.number[PERIOD]
    if period == 1 or ref.number[SOURCE] != FROM_RUN or ref.number[DEPTH] >= LONGEST_AVERAGE:
        return
    gain = 1.0 / (ref.number[DEPTH] + 1)
    for i in range(4):
        ref.template[i, place] += gain * (row[i] - ref.template[i, place])
    if place == period - 1:
        ref.number[DEPTH] += 1
