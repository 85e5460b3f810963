"""Compares an accelerometer with the second derivative of a position, without a model.

    A(f) = H·(-(2πf)²·X(f))        H = 1 for sensors that show the same motion

    X, A    spectra of position [m] and acceleration [m/s²] over a window
    H       least-squares ratio over the frequencies at which the position stands out of its noise,
            and its second derivative out of that of the acceleration

A sensor's filter, high-pass or delay turns H by some tens of degrees; a reversed sensor turns it by
180°, a wrong unit or gain changes its size, and swapped channels change both. Noise includes that
of the resolution: at rest, a coarse position that steps once in a while is no motion.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import FloatArray

LOWEST = 1.0
"""Frequencies below are left to slow drifts and high-pass filters [Hz]."""
MOTION, NOISE = 0.25, 0.6
"""Shares of half the sample rate: motion is sought below the first, noise above the second."""
STANDS_OUT, SHOWS = 1000.0, 10.0
"""Power of the position over that of its noise from which a frequency counts, and of its second
derivative over that of the acceleration's noise.
"""
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
    upper = frequency > NOISE * rate / 2
    within = (frequency >= LOWEST) & (frequency <= MOTION * rate / 2)
    expected = -((2 * np.pi * frequency) ** 2) * x
    strong = within & (power > STANDS_OUT * _noise(position, power[upper], taper))
    strong &= np.abs(expected) ** 2 > SHOWS * _noise(acceleration, np.abs(a[upper]) ** 2, taper)
    if strong.sum() < FEWEST:
        return None
    expected = expected[strong]
    h = np.vdot(expected, a[strong]) / np.vdot(expected, expected).real
    return MotionRatio(float(abs(h)), float(np.degrees(np.angle(h))))


def _noise(signal: FloatArray, powers: FloatArray, taper: FloatArray) -> float:
    """Power of a signal's noise at one frequency: the median of some, at least its resolution's."""
    steps = np.abs(np.diff(signal))
    resolution = steps[steps > 0.0].min(initial=np.inf)
    rounding = resolution**2 / 12.0 if np.isfinite(resolution) else 0.0
    return max(float(np.median(powers)), rounding * float((taper**2).sum()))
