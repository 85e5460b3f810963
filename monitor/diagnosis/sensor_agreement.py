"""Whether accelerometer and position show the same motion: a fault of drive or load leaves that so.

    d = S·a - g·D²x - l·D³x - c

    a, x     acceleration [m/s²] and position [m]
    S, D²    smoothing and second derivative over the same samples, see `motion_kernel`
    D³       the rate of D²x
    g, l, c  gain [1], lag [s] and offset [m/s²] of one sensor against the other, fitted before the
             onset, so that what both always did is no fault

The residual of the monitor's model cannot tell a lag of the accelerometer from one of the drive: in
a linear plant they are the same. Only the former shows in d.
"""

from dataclasses import dataclass

import numpy as np

from monitor.observer import MATCHED, motion_kernel
from rigwatch.wire.arrays import BoolArray, FloatArray

HALF_WIDTH = 6
"""Half length of the kernels [samples]."""
FEWEST = 128
"""Samples before the onset that the fit needs."""


@dataclass(frozen=True, eq=False)
class SensorAgreement:
    """How far the two sensors differ.

    Attributes:
        difference: d [m/s²], shape (n,).
        noise: its root mean square before the onset [m/s²].
    """

    difference: FloatArray
    noise: float
    _smoothing: FloatArray

    def response(self, read: FloatArray) -> FloatArray:
        """The difference caused by what is added to the accelerometer's reading, shape (n,)."""
        return np.correlate(read, self._smoothing, "same")


def sensor_agreement(
    position: FloatArray, acceleration: FloatArray, whole: BoolArray, onset: int, rate: float
) -> SensorAgreement | None:
    """How far two sensors differ over a stretch of samples; None if too little precedes the onset.

    Args:
        position: [m], shape (n,).
        acceleration: [m/s²], shape (n,).
        whole: samples at which both were measured, shape (n,).
        onset: row at which the change began.
        rate: sample rate [Hz].
    """
    edge = HALF_WIDTH + 1
    before = np.zeros(len(whole), np.bool_)
    before[edge : max(onset - edge, 0)] = True
    before &= np.correlate(whole, np.ones(2 * edge + 1), "same") > 2 * edge
    if before.sum() < FEWEST:
        return None
    smoothing = motion_kernel(MATCHED, HALF_WIDTH, rate)
    curvature = motion_kernel(2, HALF_WIDTH, rate)
    second = np.correlate(position - position.mean(), curvature, "same")
    motion = np.column_stack([second, np.gradient(second) * rate, np.ones(len(second))])
    smoothed = np.correlate(acceleration, smoothing, "same")
    fitted = np.linalg.lstsq(motion[before], smoothed[before], rcond=None)[0]
    difference = smoothed - motion @ fitted
    noise = float(np.sqrt(np.mean(difference[before] ** 2)))
    return SensorAgreement(difference, noise, smoothing) if noise > 0.0 else None
