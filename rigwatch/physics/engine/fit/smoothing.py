"""Smooths a measured signal and its derivatives, with a width chosen from its noise.

A third-order polynomial is fitted to the samples around each instant (A. Savitzky, M. Golay,
Analytical Chemistry 36, 1964). With the signal's power S and its white noise N at each frequency,
and the kernel's response D_w of `width` w, the error of the derivative is

    E(w) = Σ_f |D_w(f) - (2πif)^order|²·S(f) + |D_w(f)|²·N

and the width with the smallest error is used: wide for a coarse converter, narrow for a fine one.
The kernel is symmetric and has zero phase; in real time it is delayed by half its width.
"""

from math import factorial

import numpy as np
import scipy

from rigwatch.wire.arrays import ComplexArray, FloatArray

POLYNOMIAL = 3
"""Order of the polynomial."""
WIDTHS = tuple(range(5, 65, 2))
"""Widths to choose from [samples]."""
NOISE_BANDS = 8
"""Number of bands; the quietest gives the noise."""


def smoothed(
    signal: FloatArray, dt: float, width: int, order: int = 0, late: float = 0.0
) -> FloatArray:
    """The smoothed signal or its derivative of an order, shape (n,).

    Args:
        signal: equally spaced and without gaps, shape (n,).
        dt: time between samples [s].
        width: odd number of samples of the polynomial fit; fewer for a shorter signal.
        order: number of differentiations.
        late: lateness of the channel [s]; the polynomial is evaluated that much later.
    """
    fitting = min(width, len(signal) - 1 + len(signal) % 2)
    if fitting <= POLYNOMIAL:
        for _ in range(order):
            signal = np.gradient(signal, dt)
        return np.asarray(signal, np.float64)
    found = scipy.signal.savgol_filter(signal, fitting, POLYNOMIAL, deriv=order, delta=dt)
    for more in range(1, POLYNOMIAL + 1 - order) if late else ():
        steeper = scipy.signal.savgol_filter(
            signal, fitting, POLYNOMIAL, deriv=order + more, delta=dt
        )
        found = found + steeper * late**more / factorial(more)
    return np.asarray(found)


def best_width(signal: FloatArray, order: int) -> int:
    """Width with the smallest expected error of a derivative.

    Args:
        signal: equally spaced and without gaps, shape (n,).
        order: number of differentiations.
    """
    allowed = [width for width in WIDTHS if width < len(signal) // 4] or [WIDTHS[0]]
    tapered = (signal - np.linspace(signal[0], signal[-1], len(signal))) * np.hanning(len(signal))
    power = np.abs(np.fft.rfft(tapered)) ** 2
    noise = _quietest(power)
    # Noise alone does not exceed this at any frequency.
    highest = noise * (np.log(len(power)) + 3)
    above = np.where(power > highest, power - noise, 0.0)
    frequency: FloatArray = 2 * np.pi * np.fft.rfftfreq(len(signal)).astype(np.float64)
    ideal = frequency**order
    errors = []
    for width in allowed:
        response = _amplitude(_transformed(_kernel(width, order), len(signal)), order)
        errors.append(float(np.sum((response - ideal) ** 2 * above + response**2 * noise)))
    return allowed[int(np.argmin(errors))]


def flat_to(width: int, order: int) -> float:
    """Frequency up to which the kernel differentiates within 5 %, relative to the sample rate."""
    frequency = np.linspace(1e-3, np.pi, 2000)
    response = _response(width, order, frequency) / frequency**order
    off = np.flatnonzero(np.abs(response - 1) > 0.05)
    return float(frequency[off[0]] if off.size else np.pi) / (2 * np.pi)


def _quietest(power: FloatArray) -> float:
    """Noise power per frequency line: the mean of the quietest band."""
    bands = [band for band in np.array_split(power[1:], NOISE_BANDS) if band.size]
    return float(min(np.mean(band) for band in bands))


def _response(width: int, order: int, frequency: FloatArray) -> FloatArray:
    """Amplitude response of the kernel without its phase of order·90°; in samples."""
    at = np.arange(width) - width // 2
    return _amplitude(np.exp(1j * np.outer(frequency, at)) @ _kernel(width, order), order)


def _kernel(width: int, order: int) -> FloatArray:
    """Weights of the samples about an instant, shape (width,)."""
    return np.asarray(scipy.signal.savgol_coeffs(width, POLYNOMIAL, deriv=order, use="dot"))


def _transformed(kernel: FloatArray, samples: int) -> ComplexArray:
    """A kernel's response at the frequencies of `rfft` of so many samples."""
    about = np.zeros(samples)
    np.add.at(about, (np.arange(len(kernel)) - len(kernel) // 2) % samples, kernel)
    return np.conj(np.fft.rfft(about))


def _amplitude(response: ComplexArray, order: int) -> FloatArray:
    return np.asarray((response / 1j**order).real, np.float64)
