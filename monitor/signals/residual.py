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
"""

from typing import NamedTuple

import numpy as np

from monitor.model import RigModel, TransferPlant
from monitor.signals.admission import DEAD, GOOD, LARGEST, NEW_BOOT, RESTART, Codes
from rigwatch.physics.transfer import TransferFunction, filter_sample, velocity_filter
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel
from rigwatch.wire.messages import ByteArray

COLUMNS = ("voltage", "position", "acceleration", "modelled", "velocity", "g1", "g2")
"""Columns of the stage's output."""
VOLTAGE, POSITION, ACCELERATION, MODELLED, VELOCITY, G1, G2 = range(7)


class _Filters(NamedTuple):
    """Coefficients and states of the four filters, and the measured signals' delay line."""

    plant_b: FloatArray
    plant_a: FloatArray
    plant_state: FloatArray
    velocity_b: FloatArray
    velocity_a: FloatArray
    velocity_state: FloatArray
    friction_b: FloatArray
    friction_a: FloatArray
    sign_state: FloatArray
    speed_state: FloatArray
    late: FloatArray
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
        friction = model.friction.function().padded()
        self._filters = _Filters(
            *_with_state(acceleration),
            *_with_state(velocity),
            *friction,
            np.zeros(max(friction[0].size - 1, 1)),
            np.zeros(max(friction[0].size - 1, 1)),
            np.zeros((delay + 1, 3)),
            np.zeros(1, np.uint8),
        )
        self.delay = delay
        self.reset = np.zeros(0, np.bool_)

    def update(self, signals: FloatArray, code: Codes) -> FloatArray:
        """The next samples, shape (n, 3) of V, x, a, to the stage's columns, shape (n, 7).

        `code` is changed where the filters are reset, which `reset`, shape (n,), marks.
        """
        out = np.zeros((code.size, len(COLUMNS)))
        self.reset = np.zeros(code.size, np.bool_)
        _advance(signals, code, self._filters, out, self.reset)
        return out


def _with_state(function: TransferFunction) -> tuple[FloatArray, FloatArray, FloatArray]:
    b, a = function.padded()
    return b, a, np.zeros(max(b.size - 1, 1))


@kernel()
def _clear(f: _Filters) -> None:
    f.plant_state[:] = 0.0
    f.velocity_state[:] = 0.0
    f.sign_state[:] = 0.0
    f.speed_state[:] = 0.0
    f.late[:] = 0.0


@kernel()
def _within_limits(row: FloatArray) -> bool:
    for value in row:  # noqa: SIM110 (no generators in a compiled kernel)
        if not abs(value) <= LARGEST:  # also false for NaN
            return False
    return True


@kernel()
def _advance(
    signals: FloatArray, code: Codes, f: _Filters, out: FloatArray, reset: BoolArray
) -> None:
    longest = f.late.shape[0]
    for k in range(code.size):
        if f.was_reset[0] and code[k] == GOOD:
            code[k] = RESTART
        if code[k] == RESTART or code[k] == NEW_BOOT:
            f.was_reset[0] = 0
            _clear(f)
        if code[k] == DEAD:
            continue
        for i in range(longest - 1, 0, -1):
            for c in range(3):
                f.late[i, c] = f.late[i - 1, c]
        for c in range(3):
            f.late[0, c] = signals[k, c]
            out[k, c] = f.late[longest - 1, c]
        out[k, 0] = signals[k, 0]
        speed = filter_sample(f.velocity_b, f.velocity_a, f.velocity_state, out[k, 2])
        sign = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
        out[k, 3] = filter_sample(f.plant_b, f.plant_a, f.plant_state, signals[k, 0])
        out[k, 4] = speed
        out[k, 5] = filter_sample(f.friction_b, f.friction_a, f.sign_state, sign)
        out[k, 6] = filter_sample(f.friction_b, f.friction_a, f.speed_state, speed)
        if not _within_limits(out[k]):
            _clear(f)
            out[k] = 0.0
            code[k] = DEAD
            f.was_reset[0] = 1
            reset[k] = True
