"""The healthy reference for the current excitation: one period of each signal and its scatter.

A linear model leaves about a tenth of the acceleration of a pneumatic rig unexplained. That part is
not noise: it repeats with the excitation. Its average over whole periods is subtracted, which
leaves the change of the residual

    y(φ) = [ a(φ) - s·am(φ) ] - [ A(φ) - s·AM(φ) ],   s = Σ A·AM / Σ AM²

with φ the place in the period, A and AM the averages of measured and modelled acceleration, and s
the amplitude scale. The average comes from the model file if it contains this excitation, otherwise
from the first second of the run, and it is extended while the rig is clearly healthy.

An aperiodic excitation has no such average; see `aperiodic.py`.

    SETTLING ──settled, period found──▶ LEARNING ──enough periods, quiet──▶ ARMED
        ▲    ──a reference of the model file fits and agrees─────────────────▲
        └─────────── another excitation, or a new boot ────────────────────────┘

Where more than a quarter of the samples are missing, it begins to settle, or to learn, again.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

import numpy as np

from monitor.reference.aperiodic import arm_aperiodic, learn_aperiodic
from monitor.reference.averages import FEWEST_OF_A_PLACE, average, enough_known
from monitor.reference.reference_state import (
    APERIODIC,
    ARMED,
    FIXED,
    FROM_MODEL,
    FROM_RUN,
    LEARNING,
    LONGEST_AVERAGE,
    NO_REFERENCE,
    RESUMING,
    SETTLING,
    STRETCHES,
    Reference,
    ReferenceRules,
)
from monitor.signals import fill, fill_rows
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part

MOST_MISSING = 4
"""Share of the samples, as a divisor, that may be missing while a reference is learnt."""

FEWEST_PAIRS = 4
"""Share of the pairs of samples a period apart, as a divisor, that must be known."""


@part()
def restart(ref: Reference, new_boot: bool) -> None:
    """Settle again after a reset of the filters; discard the reference if its phase is lost."""
    _settle_again(ref)
    ref.counts.learnt = ref.counts.unlearnt = 0
    keeps = ref.counts.mode in (ARMED, RESUMING)
    ref.counts.mode = RESUMING if keeps and not new_boot else SETTLING
    if ref.counts.mode == SETTLING:
        ref.counts.source = NO_REFERENCE


@part(inline="always")
def place_in_period(ref: Reference, seq: int) -> int:
    """φ of sample number `seq`."""
    return (seq - ref.counts.anchor) % ref.counts.period


@part(inline="always")
def learnt_here(ref: Reference) -> int:
    """Number of samples of this run in the reference, 0 if it is from the model file."""
    own = ref.counts.source in (FROM_RUN, APERIODIC)
    return ref.counts.depth * ref.counts.period if own else 0


@part()
def observe(ref: Reference, rules: ReferenceRules, seq: int, row: FloatArray) -> None:
    """Process one good sample (V, x, a, am) before the reference is armed; may arm it."""
    counts = ref.counts
    counts.since += 1
    _remember(ref, row[0])
    if counts.mode == RESUMING:
        if counts.since >= rules.settle:
            counts.mode = ARMED
    elif counts.mode == SETTLING:
        if counts.since >= rules.settle and (rules.fixed or counts.since % 16 == 0):
            _settled(ref, rules, seq)
    elif counts.mode == LEARNING:
        _learn(ref, rules, seq, row)


@part()
def pass_over(ref: Reference) -> None:
    """Process one missing sample before the reference is armed, so that places keep their time."""
    _remember(ref, np.nan)
    if ref.counts.mode == LEARNING:
        ref.counts.unlearnt += 1
        if ref.counts.source == FROM_RUN:
            ref.counts.learnt += 1


@part()
def _settled(ref: Reference, rules: ReferenceRules, seq: int) -> None:
    """Begin to learn, or settle again if the line has lost too many samples."""
    if not _few(ref.counts.ring_missing, ref.counts.ring_fill):
        _settle_again(ref)
    elif rules.fixed:
        _arm_fixed(ref, rules)
    else:
        _look_for_period(ref, rules, seq)


@part(inline="always")
def _few(missing: int, samples: int) -> bool:
    """Whether so few samples are missing that those between them are as on a sound line.

    Without a reference they are interpolated. The filters follow what is guessed, and a reference
    that is learnt of guesses departs from the rig as soon as its own periods fill the gaps.
    """
    return missing * MOST_MISSING <= samples


@part()
def _settle_again(ref: Reference) -> None:
    """Forget the samples seen since the last restart."""
    ref.counts.since = 0
    ref.counts.ring_fill = 0
    ref.counts.ring_head = 0
    ref.counts.ring_missing = 0


@part()
def _arm_fixed(ref: Reference, rules: ReferenceRules) -> None:
    """Arm without a healthy average: the residual is friction, with limits from the model file."""
    fill_rows(ref.template, 0.0)
    fill(ref.seen, FEWEST_OF_A_PLACE)
    ref.counts.period, ref.counts.anchor, ref.counts.depth = 1, 0, LONGEST_AVERAGE
    ref.counts.source, ref.counts.mode = FIXED, ARMED
    ref.levels.scale, ref.levels.noise = 1.0, rules.residual_noise


@part()
def _learn_again(ref: Reference) -> None:
    """Forget what was learnt."""
    ref.counts.learnt = ref.counts.unlearnt = 0
    fill_rows(ref.sums, 0.0)
    fill(ref.products, 0.0)
    fill(ref.seen, 0)


@part()
def _remember(ref: Reference, voltage: float) -> None:
    size = ref.ring.size
    if ref.counts.ring_fill == size and np.isnan(ref.ring[ref.counts.ring_head]):
        ref.counts.ring_missing -= 1
    if np.isnan(voltage):
        ref.counts.ring_missing += 1
    ref.ring[ref.counts.ring_head] = voltage
    ref.counts.ring_head = (ref.counts.ring_head + 1) % size
    ref.counts.ring_fill = min(ref.counts.ring_fill + 1, size)


@part()
def _past(ref: Reference, ago: int) -> float:
    """Voltage `ago` samples before the newest."""
    return ref.ring[(ref.counts.ring_head - 1 - ago) % ref.ring.size]


@part()
def _swing(ref: Reference, count: int) -> float:
    mean, known = 0.0, 0
    for n in range(count):
        if not np.isnan(_past(ref, n)):
            mean += _past(ref, n)
            known += 1
    mean /= max(known, 1)
    square = 0.0
    for n in range(count):
        if not np.isnan(_past(ref, n)):
            square += (_past(ref, n) - mean) ** 2
    return np.sqrt(square / max(known, 1))


@part()
def _look_for_period(ref: Reference, rules: ReferenceRules, seq: int) -> None:
    count = ref.counts.ring_fill
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
        ref.counts.source = APERIODIC


@part()
def _repeats(ref: Reference, period: int, count: int, tolerance: float) -> bool:
    """Whether the voltage repeats after `period`; stops at the first contradiction.

    Of a line that loses samples, few two that far apart may be known: they show nothing.
    """
    total, known = 0.0, 0
    for n in range(count):
        moved = _past(ref, n) - _past(ref, n + period)
        if not np.isnan(moved):
            total += moved**2
            known += 1
        if total > tolerance * count:
            return False
    return known * FEWEST_PAIRS >= count and total <= tolerance * known


@part()
def _found(ref: Reference, rules: ReferenceRules, seq: int, period: int, swing: float) -> None:
    counts, levels = ref.counts, ref.levels
    counts.period, counts.anchor = period, seq + 1
    counts.depth = 0
    levels.swing = swing
    levels.noise = rules.residual_noise
    levels.position_noise = rules.position_noise
    levels.voltage_noise = rules.voltage_noise
    _learn_again(ref)
    counts.mode = LEARNING
    counts.source = FROM_RUN
    for index in range(ref.known_period.size):
        if ref.known_period[index] == period and period > 1:
            turn = _turn(ref, index, period, swing)
            if turn >= 0:
                _take_known(ref, index, period, turn, seq)
                return


@part()
def _turn(ref: Reference, index: int, period: int, swing: float) -> int:
    """Place of the newest voltage in the known period, -1 if it is another excitation."""
    best, best_turn = (0.02 * swing) ** 2 * period, -1
    for turn in range(period):
        total = 0.0
        for n in range(period):
            moved = _past(ref, n) - ref.known[index, 0, (turn - n) % period]
            if not np.isnan(moved):
                total += moved**2
            if total >= best:
                break
        if total < best:
            best, best_turn = total, turn
    return best_turn


@part()
def _take_known(ref: Reference, index: int, period: int, turn: int, seq: int) -> None:
    """Use the model file's reference without learning; a fault from the start is detected."""
    for row in range(4):
        for place in range(period):
            ref.template[row, place] = ref.known[index, row, place]
    ref.counts.anchor = seq - turn
    ref.counts.depth = ref.known_depth[index]
    fill(ref.seen, FEWEST_OF_A_PLACE)
    ref.levels.scale = ref.known_scale[index]
    ref.counts.source = FROM_MODEL
    _measure_swings(ref)
    ref.counts.mode = ARMED


@part()
def _learn(ref: Reference, rules: ReferenceRules, seq: int, row: FloatArray) -> None:
    counts, period = ref.counts, ref.counts.period
    if period == 1:
        _learn_level(ref, rules, row)
        return
    place = place_in_period(ref, seq)
    for i in range(4):
        ref.sums[i, place] += row[i]
    ref.seen[place] += 1
    ref.products[0] += row[2] * row[2]
    ref.products[1] += row[2] * row[3]
    ref.products[2] += row[3] * row[3]
    ref.products[3] += row[1] * row[1]
    ref.products[4] += row[0] * row[0]
    counts.learnt += 1
    wanted = max(4, (rules.learn + period - 1) // period) * period
    if counts.learnt >= wanted and not _few(counts.unlearnt, counts.learnt):
        _learn_again(ref)
    elif counts.learnt >= wanted and enough_known(ref):
        _finish_learning(ref, rules, wanted // period)


@part()
def _learn_level(ref: Reference, rules: ReferenceRules, row: FloatArray) -> None:
    """Process one sample of an aperiodic drive."""
    counts = ref.counts
    learn_aperiodic(ref, rules.learn, row)
    ref.seen[0] = FEWEST_OF_A_PLACE
    if counts.learnt >= STRETCHES * rules.learn:
        if _few(counts.unlearnt, counts.learnt + counts.unlearnt):
            arm_aperiodic(ref, rules.learn)
        else:
            _learn_again(ref)


@part(allocates=True)
def _finish_learning(ref: Reference, rules: ReferenceRules, depth: int) -> None:
    """Compute averages, amplitude scale and scatter; restart if the rig has not settled."""
    counts, levels, period = ref.counts, ref.levels, ref.counts.period
    average(ref)
    counts.depth, counts.refined = depth, 0
    aa = am = mm = xx = vv = 0.0
    # Energies of the averages over whole periods, and over the samples beyond or short of them.
    more, moreover = np.zeros(5), 0
    for place in range(period):
        count = ref.seen[place] - depth
        moreover += count + (1 if ref.seen[place] == 0 else 0)
        v, x = ref.template[0, place], ref.template[1, place]
        a, m = ref.template[2, place], ref.template[3, place]
        more[0] += count * a**2
        more[1] += count * a * m
        more[2] += count * m**2
        more[3] += count * x**2
        more[4] += count * v**2
        aa += a**2
        am += a * m
        mm += m**2
        xx += x**2
        vv += v**2
    scale = am / mm if mm > 0.0 else 0.0
    freedom = period * (depth - 1) + moreover
    p = more
    for i in range(5):
        p[i] = ref.products[i] - more[i]
    scatter = (p[0] - depth * aa) - 2.0 * scale * (p[1] - depth * am)
    scatter += scale**2 * (p[2] - depth * mm)
    noise = np.sqrt(max(scatter, 0.0) / freedom)
    levels.scale = scale
    levels.noise = max(noise, rules.residual_noise)
    levels.position_noise = max(
        np.sqrt(max(p[3] - depth * xx, 0.0) / freedom), rules.position_noise
    )
    levels.voltage_noise = max(np.sqrt(max(p[4] - depth * vv, 0.0) / freedom), rules.voltage_noise)
    _measure_swings(ref)
    quiet = noise <= 1.5 * rules.residual_noise
    if quiet:
        counts.mode = ARMED
    else:
        _learn_again(ref)


@part()
def _measure_swings(ref: Reference) -> None:
    period = ref.counts.period
    ref.levels.swing = _periodic_rms(ref.template[0], period)
    ref.levels.position_swing = _periodic_rms(ref.template[1], period)
    ref.levels.acceleration_swing = _periodic_rms(ref.template[2], period)
    ref.counts.cycle = period // _turns(ref)


@part()
def _periodic_rms(signal: FloatArray, period: int) -> float:
    """Root mean square of one period of a signal around its mean."""
    mean = 0.0
    for k in range(period):
        mean += signal[k] / period
    square = 0.0
    for k in range(period):
        square += (signal[k] - mean) ** 2 / period
    return np.sqrt(square)


@part()
def _turns(ref: Reference) -> int:
    """Number of cycles of the motion per period of the samples, at least one.

    For example, an excitation of 5 Hz repeats after 256 samples, which contain five cycles.
    """
    period, swing = ref.counts.period, ref.levels.position_swing
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


@part(inline="always")
def refine(ref: Reference, place: int, row: FloatArray) -> None:
    """Add one clearly healthy sample to the average, until it is complete."""
    period = ref.counts.period
    if period == 1 or ref.counts.source != FROM_RUN or ref.counts.depth >= LONGEST_AVERAGE:
        return
    gain = 1.0 / (ref.counts.depth + 1)
    for i in range(4):
        ref.template[i, place] += gain * (row[i] - ref.template[i, place])
    # A line may never show the last place of the period.
    ref.counts.refined += 1
    if ref.counts.refined >= period:
        ref.counts.refined = 0
        ref.counts.depth += 1
