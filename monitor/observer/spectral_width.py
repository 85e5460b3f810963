"""Current bandwidth of the motion's spectrum: narrow for a tone, broad for noise.

    q = ⟨v²⟩ / √(⟨(∫v)²⟩·⟨(Δv)²⟩),   1 for one frequency, less for several at once

This is the bandwidth parameter of random processes (D. E. Cartwright, M. S. Longuet-Higgins, Proc.
Royal Society A 237, 1956). A remainder fitted to single tones is not valid for several at once, as
nonlinear terms missing in the equations mix them.
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
    """

    narrow: FloatArray
    pace: FloatArray
    size: FloatArray


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
        self._kept = np.zeros(5)

    def update(self, speed: FloatArray, state: Codes) -> Spectrum:
        """The spectrum after each sample of a speed of shape (n,)."""
        out = np.zeros((3, len(speed)))
        out[0] = 1.0
        _advance(speed, state, self._leak, self._share, self._slow, self._kept, out)
        narrow, pace, size = out
        return Spectrum(narrow, pace * self._rate / (2.0 * np.pi), size * self._rate)


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
    """`kept` holds displacement, last speed, and mean squares of displacement, speed and change."""
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
        if kept[3] > slow * slow:
            out[0, k] = kept[3] / max(np.sqrt(kept[2] * kept[4]), 1e-300)
            out[1, k] = np.sqrt(kept[4] / kept[3])
            out[2, k] = np.sqrt(kept[4])
