"""From samples to the acceleration residual's ingredients, rig with a transfer function
(docs/theory.md 1.2 to 1.4).

    modelled   am = fs²·(1 - q⁻¹)²·q^s·Ĝ(q⁻¹)·V      advanced by the measured shift s [samples]
    velocity   v  = high-pass and integrator of a    [m/s]
    regressors g1 = Ge[sgn v], g2 = Ge[v]            [m/s^2] per unit of θ

Ĝ begins with q⁻¹, so one sample of advance costs nothing; a longer one delays the measured signals
instead.

A recursive filter keeps a number that is not finite for ever, and an unstable one grows without
limit. Each sample's results are therefore checked: beyond `LARGEST` every filter is reset, the
sample counts as dead, and the next good one restarts the estimates.

A rig rings for a second or more, and so does the modelled acceleration after one wrong voltage. A
sample that is missing is therefore held only until the next good one. The filters then go back to
the last good sample and pass the gap again, with the readings that both ends make likely.
"""

from typing import NamedTuple

import numpy as np

from monitor.model import RigModel, TransferPlant
from monitor.signals.admission import DEAD, GOOD, HELD, LARGEST, NEW_BOOT, RESTART, Codes
from monitor.signals.small_rows import copy, copy_rows, fill, fill_rows
from rigwatch.physics.transfer import TransferFunction, filter_sample, velocity_filter
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray

COLUMNS = ("voltage", "position", "acceleration", "modelled", "velocity", "g1", "g2")
"""Columns of the stage's output."""
VOLTAGE, POSITION, ACCELERATION, MODELLED, VELOCITY, G1, G2 = range(7)
NOTHING = np.zeros((0, 3))
"""No usual readings are known."""


class _States(NamedTuple):
    """States of the four filters, and the measured signals' delay line, whose last column marks
    samples that are missing.
    """

    plant: FloatArray
    velocity: FloatArray
    sign: FloatArray
    speed: FloatArray
    late: FloatArray


class Filters(NamedTuple):
    """Coefficients and states of the four filters, and what a gap needs: the states and the
    readings of the last good sample, and the number of missing ones since.
    """

    plant_b: FloatArray
    plant_a: FloatArray
    velocity_b: FloatArray
    velocity_a: FloatArray
    friction_b: FloatArray
    friction_a: FloatArray
    now: _States
    before: _States
    last: FloatArray
    missing: Codes
    was_reset: ByteArray


def modelled_acceleration(plant: TransferPlant, sample_rate: float) -> tuple[TransferFunction, int]:
    """The filter from voltage [V] to modelled acceleration [m/s^2], and the delay of the measured
    signals [samples].
    """
    function = plant.function()
    leading = int(np.argmax(function.b != 0.0))
    advance = min(plant.shift, leading)
    advanced = TransferFunction(function.b[advance:], function.a)
    return advanced.second_difference(sample_rate), plant.shift - advance


class TransferResidual:
    """The stage for a rig whose model is a transfer function."""

    def __init__(self, model: RigModel) -> None:
        if not isinstance(model.plant, TransferPlant):
            raise TypeError("TransferResidual needs a transfer function")
        acceleration, delay = modelled_acceleration(model.plant, model.sample_rate)
        velocity = velocity_filter(
            model.velocity.corner, model.sample_rate, model.velocity.sensor_corner
        )
        functions = (acceleration, velocity, model.friction.function())
        self.filters = Filters(
            *acceleration.padded(),
            *velocity.padded(),
            *functions[2].padded(),
            _states_of(functions, delay),
            _states_of(functions, delay),
            np.zeros(3),
            np.zeros(1, np.int64),
            np.zeros(1, np.uint8),
        )
        self.delay = delay
        self.reset = np.zeros(0, np.bool_)

    def update(self, signals: FloatArray, code: Codes, usual: FloatArray = NOTHING) -> FloatArray:
        """The next samples, shape (n, 3) of V, x, a, to the stage's columns, shape (n, 7).

        `code` is changed where the filters are reset, which `reset`, shape (n,), marks, and where a
        missing sample leaves the delay line. `usual` has what is usual there for the signals from
        the last good sample to the first one after a gap, shape (m, 3): the readings between are
        the usual ones and the interpolated deviation of both ends from them. Without it, they are
        interpolated.
        """
        out = np.zeros((code.size, len(COLUMNS)))
        self.reset = np.zeros(code.size, np.bool_)
        advance_filters(signals, code, usual, self.filters, out, self.reset)
        return out


def _states_of(functions: tuple[TransferFunction, ...], delay: int) -> _States:
    plant, velocity, friction = (max(each.padded()[0].size - 1, 1) for each in functions)
    return _States(
        np.zeros(plant),
        np.zeros(velocity),
        np.zeros(friction),
        np.zeros(friction),
        np.zeros((delay + 1, 4)),
    )


@part()
def _clear(f: Filters) -> None:
    fill(f.now.plant, 0.0)
    fill(f.now.velocity, 0.0)
    fill(f.now.sign, 0.0)
    fill(f.now.speed, 0.0)
    fill_rows(f.now.late, 0.0)
    f.missing[0] = 0


@part()
def _copy(source: _States, to: _States) -> None:
    copy(source.plant, to.plant)
    copy(source.velocity, to.velocity)
    copy(source.sign, to.sign)
    copy(source.speed, to.speed)
    copy_rows(source.late, to.late)


@part()
def _within_limits(row: FloatArray) -> bool:
    for c in range(len(COLUMNS)):  # noqa: SIM110 (no generators in a compiled kernel)
        if not abs(row[c]) <= LARGEST:  # also false for NaN
            return False
    return True


@part(inline="always")
def _filter(readings: FloatArray, missing: bool, f: Filters, out: FloatArray) -> None:
    """One sample through all filters, to the stage's columns, shape (7,)."""
    state, late = f.now, f.now.late
    oldest = late.shape[0] - 1
    for i in range(oldest, 0, -1):
        for c in range(4):
            late[i, c] = late[i - 1, c]
    for c in range(3):
        late[0, c] = readings[c]
    late[0, 3] = 1.0 if missing else 0.0
    out[0], out[1], out[2] = readings[0], late[oldest, 1], late[oldest, 2]
    speed = filter_sample(f.velocity_b, f.velocity_a, state.velocity, out[2])
    sign = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
    out[3] = filter_sample(f.plant_b, f.plant_a, state.plant, readings[0])
    out[4] = speed
    out[5] = filter_sample(f.friction_b, f.friction_a, state.sign, sign)
    out[6] = filter_sample(f.friction_b, f.friction_a, state.speed, speed)


@part(allocates=True)
def _pass_gap(readings: FloatArray, usual: FloatArray, f: Filters) -> None:
    """Pass the missing samples again, now that `readings` after them are known."""
    count, unused, between = f.missing[0], np.zeros(7), np.zeros(3)
    known = usual.shape[0] == count + 2
    _copy(f.before, f.now)
    for k in range(1, count + 1):
        share = k / (count + 1.0)
        for c in range(3):
            first, here, last = f.last[c], 0.0, readings[c]
            if known:
                first, here, last = first - usual[0, c], usual[k, c], last - usual[count + 1, c]
            between[c] = here + (1.0 - share) * first + share * last
        _filter(between, True, f, unused)
    f.missing[0] = 0


@part(inline="always")
def _follow_gap(readings: FloatArray, held: bool, usual: FloatArray, f: Filters) -> None:
    """Keep what a gap needs, before its first sample and after its last one."""
    if held:
        if f.missing[0] == 0:
            _copy(f.now, f.before)
        f.missing[0] += 1
        return
    if f.missing[0] > 0:
        _pass_gap(readings, usual, f)
    for c in range(3):
        f.last[c] = readings[c]


@kernel()
def advance_filters(  # noqa: PLR0917 -- a kernel
    signals: FloatArray,
    code: Codes,
    usual: FloatArray,
    f: Filters,
    out: FloatArray,
    reset: BoolArray,
) -> None:
    """`TransferResidual.update`, which see."""
    oldest = f.now.late.shape[0] - 1
    for k in range(code.size):
        if f.was_reset[0] and code[k] == GOOD:
            code[k] = RESTART
        if code[k] == RESTART or code[k] == NEW_BOOT:
            f.was_reset[0] = 0
            _clear(f)
        if code[k] == DEAD:
            continue
        held = code[k] == HELD
        _follow_gap(signals[k], held, usual, f)
        _filter(signals[k], held, f, out[k])
        if f.now.late[oldest, 3] > 0.0:
            code[k] = HELD
        if not _within_limits(out[k]):
            _clear(f)
            fill(out[k], 0.0)
            code[k] = DEAD
            f.was_reset[0] = 1
            reset[k] = True
