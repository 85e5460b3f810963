"""The first-order high-pass that follows an operating point, and its effect on a model.

v(t) = β·( v(t-1) + u(t) - u(t-1) ),   β = 1/(1 + 2π·fc/fs),   v = 0 at the start

fc  corner [Hz]    fs  sample rate [Hz]    β  share that is remembered; 1 for fc = 0
"""

import numpy as np

from rigwatch.physics.transfer import TransferFunction
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part


def decay_factor(corner: float, sample_rate: float) -> float:
    """β of a corner [Hz]."""
    return float(1.0 / (1.0 + 2.0 * np.pi * corner / sample_rate))


def high_passed(values: FloatArray, corner: float, sample_rate: float) -> FloatArray:
    """Filter a whole signal from rest, shape (n,)."""
    beta = decay_factor(corner, sample_rate)
    return TransferFunction.of([beta, -beta], [1.0, -beta]).simulate(values - values[0])


def leaky(function: TransferFunction, corner: float, sample_rate: float) -> TransferFunction:
    """`function` with poles slower than the high-pass moved to its corner.

    Above the corner nothing changes; an integrator becomes a leaky one.
    """
    beta = decay_factor(corner, sample_rate)
    poles = function.poles
    slow = np.abs(poles) > beta
    poles[slow] *= beta / np.abs(poles[slow])
    return TransferFunction.of(function.b, np.real(np.poly(poles)))


@part()
def high_pass_sample(beta: float, last: FloatArray, high: FloatArray, values: FloatArray) -> None:
    """One sample of several signals: `high` becomes the output, `last` the input."""
    for i in range(values.size):
        if beta == 1.0:
            high[i] = values[i]
        else:
            high[i] = beta * (high[i] + values[i] - last[i])
        last[i] = values[i]
