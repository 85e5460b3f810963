"""Current bandwidth of the motion's spectrum: narrow for a tone, broad for noise.

    q = ⟨v²⟩ / √(⟨(∫v)²⟩·⟨(Δv)²⟩),   1 for one frequency, less for several at once

This is the bandwidth parameter of random processes (D. E. Cartwright, M. S. Longuet-Higgins, Proc.
Royal Society A 237, 1956). A remainder fitted to single tones is not valid for several at once, as
nonlinear terms missing in the equations mix them.

    s = ⟨v³⟩/⟨v²⟩^1.5,   s' = ⟨(Δv)³⟩/⟨(Δv)²⟩^1.5

The skewnesses of the speed and of its rate show how strong the second harmonic of a tone is, and
its phase relative to the first: the bispectrum at one frequency, which no delay changes (J. M.
Mendel, Proc. IEEE 79, 1991).
"""

from typing import NamedTuple

import numpy as np

from monitor.observer.lagged_motion import EMPTY, FIRST
from monitor.signals import Codes, fill
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import kernel

SLOWEST = 1.0
"""Corner below which motion is ignored, as the mass drifts [Hz]."""
MEMORY = 0.5
"""Averaging time of the means [s]."""


class Spectrum(NamedTuple):
    """Spectral parameters of the motion after each sample, each of shape (n,).

    Attributes:
        narrow: q; 1 at rest and with an incomplete kernel.
        pace: mean frequency, from √(⟨(Δv)²⟩/⟨v²⟩) as for a tone [Hz]; 0 at rest.
        size: root mean square of the rate of the speed [m/s^2]; 0 at rest.
        skew: skewness of the speed; 0 at rest.
        skew_rate: skewness of its rate; 0 at rest.
    """

    narrow: FloatArray
    pace: FloatArray
    size: FloatArray
    skew: FloatArray
    skew_rate: FloatArray


class SpectralWidth:
    """Carries the means from block to block.

    Args:
        slow: speed that cannot be distinguished from rest [m/s].
        rate: sample rate [Hz].
    """

    def __init__(self, slow: float, rate: float) -> None:
        self._leak = float(np.exp(-2.0 * np.pi * SLOWEST / rate))
        self._share = 1.0 / (MEMORY * rate)
        self._slow, self._rate = slow, rate
        self._kept = np.zeros(7)

    def update(self, speed: FloatArray, state: Codes) -> Spectrum:
        """The spectrum after each sample of a speed of shape (n,)."""
        out = np.zeros((len(Spectrum._fields), len(speed)))
        out[0] = 1.0
        _advance(speed, state, self._leak, self._share, self._slow, self._kept, out)
        narrow, pace, size, *skews = out
        return Spectrum(narrow, pace * self._rate / (2.0 * np.pi), size * self._rate, *skews)


@kernel()
def _advance(  # noqa: PLR0917 -- a kernel
    speed: FloatArray,
    state: Codes,
    leak: float,
    share: float,
    slow: float,
    kept: FloatArray,
    out: FloatArray,
) -> None:
    """`kept` holds displacement, last speed, mean squares of displacement, speed and change, and
    mean cubes of the last two.
    """
    for k in range(state.size):
        if state[k] == EMPTY:
            continue
        if state[k] == FIRST:
            fill(kept, 0.0)
            kept[1] = speed[k]
        kept[0] = leak * kept[0] + speed[k]
        change = speed[k] - kept[1]
        kept[1] = speed[k]
        kept[2] += share * (kept[0] * kept[0] - kept[2])
        kept[3] += share * (speed[k] * speed[k] - kept[3])
        kept[4] += share * (change * change - kept[4])
        kept[5] += share * (speed[k] * speed[k] * speed[k] - kept[5])
        kept[6] += share * (change * change * change - kept[6])
        if kept[3] > slow * slow:
            out[0, k] = kept[3] / max(np.sqrt(kept[2] * kept[4]), 1e-300)
            out[1, k] = np.sqrt(kept[4] / kept[3])
            out[2, k] = np.sqrt(kept[4])
            out[3, k] = kept[5] / max(kept[3] * np.sqrt(kept[3]), 1e-300)
            out[4, k] = kept[6] / max(kept[4] * np.sqrt(kept[4]), 1e-300)
