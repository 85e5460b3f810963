"""A synthetic earthquake: noise through the soil filter of Kanai and Tajimi, with an envelope.

    ẍg = −(2·ζg·ωg·ż + ωg²·z),   z̈ + 2·ζg·ωg·ż + ωg²·z = −w(t)

with ωg = 15.6 rad/s and ζg = 0.6 of firm ground (K. Kanai 1957, H. Tajimi 1960). The envelope rises
with t², holds, and decays; the peak is scaled to 0.34 g, that of El Centro in 1940, whose own
record is not shipped.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from sim_plant.structure import sample_times

Floats = NDArray[np.float64]

SOIL_FREQUENCY, SOIL_DAMPING = 15.6, 0.6
PEAK = 0.34 * 9.81
RISE, HOLD, DECAY = 2.0, 10.0, 4.0
"""Ends of rise and hold, and time constant of the decay [s]."""


def accelerogram(dt: float, duration: float, seed: int) -> Floats:
    """Ground acceleration every dt, shape (n,) [m/s^2]."""
    time = sample_times(dt, duration)
    white = np.random.default_rng(seed).standard_normal(len(time))
    turn = 2.0 * SOIL_DAMPING * SOIL_FREQUENCY
    soil = ([turn, SOIL_FREQUENCY**2], [1.0, turn, SOIL_FREQUENCY**2])
    numerator, denominator, _ = cont2discrete(soil, dt, method="bilinear")
    shaken = lfilter(numerator.ravel(), denominator, white) * _envelope(time)
    return np.asarray(PEAK * shaken / np.max(np.abs(shaken)))


def _envelope(time: Floats) -> Floats:
    rise = np.minimum(time / RISE, 1.0) ** 2
    return np.asarray(rise * np.exp(-np.maximum(time - HOLD, 0.0) / DECAY))
