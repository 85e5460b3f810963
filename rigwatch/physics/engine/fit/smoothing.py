"""Smooths a measured signal and its rates of change, as wide as its noise asks for.

A polynomial of third order is fitted to the samples about each instant (A. Savitzky, M. Golay,
Analytical Chemistry 36, 1964). With the signal's power S and its white noise N at each frequency,
and the kernel's response D_w of `width` w, the error of the rate is

    E(w) = Σ_f |D_w(f) - (2πif)^order|²·S(f) + |D_w(f)|²·N

and the width with the smallest error is taken: wide for a coarse converter, narrow for a fine one.
The kernel is symmetric and so has no phase; live, it is late by half its width.
"""

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter

from rigwatch.wire.arrays import FloatArray

POLYNOMIAL = 3
"""Order of the polynomial."""
WIDTHS = tuple(range(5, 65, 2))
"""Widths to choose from [samples]."""
NOISE_BANDS = 8
"""Bands of which the quietest shows the noise."""


def smoothed(signal: FloatArray, dt: float, width: int, order: int = 0) -> FloatArray:
    """The signal, or its rate of change of an order, shape (n,).

    Args:
        signal: equally spaced and without gaps, shape (n,).
        dt: time between samples [s].
        width: samples that the polynomial is fitted to, odd; fewer where the signal is shorter.
        order: how often it is differentiated.
    """
    fitting = min(width, len(signal) - 1 + len(signal) % 2)
    if fitting <= POLYNOMIAL:
        for _ in range(order):
            signal = np.gradient(signal, dt)
        return np.asarray(signal, np.float64)
    return np.asarray(savgol_filter(signal, fitting, POLYNOMIAL, deriv=order, delta=dt))


def best_width(signal: FloatArray, order: int) -> int:
    """Width with the smallest expected error of the rate of change of an order.

    Args:
        signal: equally spaced and without gaps, shape (n,).
        order: how often it is differentiated.
    """
    allowed = [width for width in WIDTHS if width < len(signal) // 4] or [WIDTHS[0]]
    tapered = (signal - np.linspace(signal[0], signal[-1], len(signal))) * np.hanning(len(signal))
    power = np.abs(np.fft.rfft(tapered)) ** 2
    noise = _quietest(power)
    # Noise alone reaches no higher than this in any of its frequencies.
    highest = noise * (np.log(len(power)) + 3)
    above = np.where(power > highest, power - noise, 0.0)
    frequency: FloatArray = 2 * np.pi * np.fft.rfftfreq(len(signal)).astype(np.float64)
    ideal = frequency**order
    errors = []
    for width in allowed:
        response = _response(width, order, frequency)
        errors.append(float(np.sum((response - ideal) ** 2 * above + response**2 * noise)))
    return allowed[int(np.argmin(errors))]


def flat_to(width: int, order: int, tolerance: float = 0.05) -> float:
    """Frequency up to which the kernel differentiates truly, over the sampling rate."""
    frequency = np.linspace(1e-3, np.pi, 2000)
    response = _response(width, order, frequency) / frequency**order
    off = np.flatnonzero(np.abs(response - 1) > tolerance)
    return float(frequency[off[0]] if off.size else np.pi) / (2 * np.pi)


def _quietest(power: FloatArray) -> float:
    """Noise power a frequency: the mean of the quietest band."""
    bands = [band for band in np.array_split(power[1:], NOISE_BANDS) if band.size]
    return float(min(np.mean(band) for band in bands))


def _response(width: int, order: int, frequency: FloatArray) -> FloatArray:
    """What the kernel makes of a frequency, without its phase of order·90°; in samples."""
    kernel = savgol_coeffs(width, POLYNOMIAL, deriv=order, use="dot")
    at = np.arange(width) - width // 2
    turned = np.exp(1j * np.outer(frequency, at)) @ kernel
    return np.asarray((turned / 1j**order).real, np.float64)
