"""The noise of a signal from the quietest band of its spectrum.

A derived signal has the noise of its channel, low-passed and differentiated: the channel's is taken
from the quietest band that is passed, and what the derivation makes of it is calculated.

The smallest of several bands is low by chance, and the lower the shorter the signal. A simulation
of white noise of the same length tells by how much, and how far the result scatters.
"""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.signal import welch

from rigwatch.physics.transfer import Derivative
from rigwatch.wire.arrays import FloatArray

BANDS = 8
SHORTEST = 64
"""Valid samples of a recording from which its spectrum counts beside those of longer ones."""
SEGMENT = 256
"""Samples of a segment of the spectrum, if the recordings are long enough."""
LONG = 5120
"""Samples from which nothing is corrected: limits on the error allow for the 4 % that are left."""
TINY = 1e-12
"""Share of its largest power below which a derivative shows rounding errors, not noise."""
DRAWS = 128
SURELY = 3.0
"""Standard deviations that noise alone hardly ever exceeds."""


def quietest_band(
    parts: Sequence[FloatArray], rate: float, top: float = 0.5, derived: Derivative | None = None
) -> tuple[float, float]:
    """Noise of a signal by its quietest band, and the ratio to it that noise alone may reach.

    Args:
        parts: the signal in each recording, NaN without a valid sample: where they join, it steps.
        rate: of the samples [Hz].
        top: highest frequency that counts, over the rate.
        derived: how the signal was derived from the one whose noise is white; None if it was not.
    """
    if derived is not None:
        top = min(top, derived.low_pass / rate)
    clean = [part[np.isfinite(part)] for part in parts]
    clean = [part for part in clean if len(part) >= SHORTEST] or [p for p in clean if len(p)]
    # The band that a low-pass leaves is divided as finely as a whole one.
    segment = SEGMENT if derived is None else round(SEGMENT * 0.5 / top)
    length = min(segment, max(min(map(len, clean)) // 4, 8))
    found = [welch(part, rate, nperseg=length) for part in clean]
    density = np.average([one for _, one in found], axis=0, weights=[len(part) for part in clean])
    frequencies = found[0][0]
    power = np.ones(len(frequencies)) if derived is None else derived.power(frequencies)
    level = _lowest(density / np.maximum(power, TINY * power.max()), frequencies / rate, top)
    rms = math.sqrt(float(level) * float(power[1:].mean()) * rate / 2)
    low, highest = _by_chance(length, min(sum(map(len, clean)), LONG), top)
    return rms / low, low * highest


@lru_cache(maxsize=256)
def _by_chance(length: int, samples: int, top: float) -> tuple[float, float]:
    """How low the quietest band is against that of a long signal, and what noise alone may reach.

    Args:
        length: samples of a segment.
        samples: of the whole signal.
        top: as in `quietest_band`.
    """
    if (length, samples) == (SEGMENT, LONG):
        return 1.0, 1.0
    ratios = _ratios_of_noise(length, samples, top)
    usual = _ratios_of_noise(SEGMENT, LONG, top)
    low = min(float(np.exp(usual.mean() - ratios.mean())), 1.0)
    return low, float(np.exp(ratios.mean() + SURELY * ratios.std()))


@lru_cache(maxsize=256)
def _ratios_of_noise(length: int, samples: int, top: float) -> FloatArray:
    """Logarithm of the ratio of white noise to its quietest band, in simulated signals."""
    noise = np.random.default_rng(0).standard_normal((DRAWS, samples))
    frequencies, density = welch(noise, nperseg=min(length, samples))
    rms = np.sqrt(_lowest(density, frequencies, top) / 2)
    return np.asarray(np.log(noise.std(axis=-1) / rms), np.float64)


def _lowest(density: FloatArray, frequencies: FloatArray, top: float) -> FloatArray:
    """Mean density of the quietest band; spectra along the last axis, frequencies over the rate."""
    inside = density[..., (frequencies > 0) & (frequencies <= max(top, frequencies[1]))]
    bands = [band for band in np.array_split(inside, BANDS, axis=-1) if band.shape[-1]]
    return np.asarray(np.min([band.mean(axis=-1) for band in bands], axis=0), np.float64)
