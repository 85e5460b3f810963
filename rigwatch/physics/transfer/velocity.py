"""Velocity from an accelerometer alone (docs/theory.md 1.3), without the lead of a high-pass.

A third-order Butterworth high-pass H(s) = s³/D(s), D = s³ + 2·c·s² + 2·c²·s + c³, removes the low
frequencies that a piezo does not measure, followed by an integrator. Well above the corner c
[rad/s] the high-pass leads by 2·c/ω, and the piezo's own corner p [rad/s] by another p/ω: enough to
shift the zero crossings of v, and with them sgn(v), by several samples. A zero at -(2·c + p)
instead of one at the origin compensates both to first order:

    v/a = s·(s + 2·c + p) / D(s)          lead-compensated
    v/a = s² / D(s)                       plain

Both keep a zero at the origin, so an accelerometer bias does not cause a velocity. The bilinear
transform makes the integrator trapezoidal; its pole is cancelled, so there is no drift.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from rigwatch.physics.transfer.transfer_function import TransferFunction
from rigwatch.wire.arrays import FloatArray


@lru_cache(maxsize=16)
def velocity_filter(
    corner: float, sample_rate: float, sensor_corner: float = 0.0, compensate_lead: bool = True
) -> TransferFunction:
    """Acceleration [m/s^2] to velocity [m/s]; remembered, as many monitors run with one model.

    Args:
        corner: corner of the high-pass [Hz].
        sample_rate: [Hz].
        sensor_corner: corner of the accelerometer's own first-order high-pass, 0 for none [Hz].
        compensate_lead: compensate the lead of both; otherwise the plain Butterworth.
    """
    c, p = 2.0 * np.pi * corner, 2.0 * np.pi * sensor_corner
    lead = 2.0 * c + p if compensate_lead else 0.0
    b = _bilinear([0.0, 1.0, lead, 0.0], sample_rate)
    a = _bilinear([1.0, 2.0 * c, 2.0 * c**2, c**3], sample_rate)
    found = TransferFunction.of(b / a[0], a / a[0])
    for shared in (found.b, found.a):
        shared.flags.writeable = False
    return found


def _bilinear(coefficients: Sequence[float], sample_rate: float) -> FloatArray:
    """A polynomial of s at s = 2·f·(z - 1)/(z + 1), times (z + 1)ⁿ; highest powers first.

    SciPy has it too, in a package that takes longer to import than the rest of a monitor's start.
    """
    degree, found = len(coefficients) - 1, np.zeros(len(coefficients))
    for power, coefficient in enumerate(reversed(coefficients)):
        zeros = [1.0] * power + [-1.0] * (degree - power)
        found += coefficient * (2.0 * sample_rate) ** power * np.poly(zeros)
    return found
