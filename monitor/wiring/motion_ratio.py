"""Compares an accelerometer with the second derivative of a position, without a model.

    A(f) = H·(-(2πf)²·X(f))        H = 1 for sensors that show the same motion

    X, A    spectra of position [m] and acceleration [m/s²] over a window
    H       least-squares ratio over the frequencies at which the position stands out of its noise

A sensor's filter, high-pass or delay turns H by some tens of degrees; a reversed sensor turns it by
180°, a wrong unit or gain changes its size, and swapped channels change both.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import FloatArray

LOWEST = 1.0
"""Frequencies below are left to slow drifts and high-pass filters [Hz]."""
MOTION, NOISE = 0.25, 0.6
"""Shares of half the sample rate: motion is sought below the first, noise above the second."""
STANDS_OUT = 1000.0
"""Power over the noise's median power from which a frequency counts."""
FEWEST = 2
"""Frequencies that a window needs."""


@dataclass(frozen=True)
class MotionRatio:
    """Measured acceleration relative to the second derivative of the position.

    Attributes:
        gain: |H| [1].
        phase: of H [deg], -180 to 180.
    """

    gain: float
    phase: float


def motion_ratio(position: FloatArray, acceleration: FloatArray, rate: float) -> MotionRatio | None:
    """H over one window; None if there is too little motion.

    Args:
        position: [m], shape (n,).
        acceleration: [m/s^2], shape (n,).
        rate: sample rate [Hz].
    """
    taper = np.hanning(len(position))
    frequency = np.fft.rfftfreq(len(position), 1 / rate)
    x = np.fft.rfft(taper * (position - position.mean()))
    a = np.fft.rfft(taper * (acceleration - acceleration.mean()))
    power = np.abs(x) ** 2
    noise = float(np.median(power[frequency > NOISE * rate / 2]))
    within = (frequency >= LOWEST) & (frequency <= MOTION * rate / 2)
    strong = within & (power > STANDS_OUT * noise)
    if strong.sum() < FEWEST:
        return None
    expected = -((2 * np.pi * frequency[strong]) ** 2) * x[strong]
    h = np.vdot(expected, a[strong]) / np.vdot(expected, expected).real
    return MotionRatio(float(abs(h)), float(np.degrees(np.angle(h))))
