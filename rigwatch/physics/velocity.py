"""Velocity from an accelerometer alone (theory 1.3).

A third-order Butterworth high-pass removes what a piezo cannot know, a trapezoidal integrator does the rest. The
integrator's pole at z = 1 cancels one of the high-pass's three zeros there, so both are one stable filter:

    H(q⁻¹) = g·(T/2)·(1 - q⁻¹)²·(1 + q⁻¹) / A(q⁻¹)
"""

import numpy as np
from scipy.signal import butter

from rigwatch.physics.transfer_function import TransferFunction


def velocity_filter(corner: float, sample_rate: float) -> TransferFunction:
    """Acceleration [m/s^2] to velocity [m/s].

    Args:
        corner: corner of the high-pass [Hz].
        sample_rate: [Hz].
    """
    b, a = butter(3, corner, "highpass", fs=sample_rate)
    zeros = np.convolve([1.0, -2.0, 1.0], [1.0, 1.0])
    return TransferFunction.of(b[0] * zeros / (2.0 * sample_rate), a)
