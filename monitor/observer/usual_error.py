"""The healthy residual's lasting energy at the present motion.

What equations leave of a healthy rig depends on the motion and hardly on anything else. A steady
motion that was recorded at commissioning is therefore compared with what was left of it then,
which is far less than the worst of all motions. Of any other motion, and while the motion changes,
the lasting energy of a healthy rig is not known.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from monitor.model import HealthyLimits
from monitor.observer.spectral_width import MEMORY, Spectrum
from rigwatch.wire.arrays import FloatArray

PACE, SIZE, NARROW = 0.03, 0.1, 0.03
"""Differences up to which motions are the same: relative in frequency and size, in narrowness."""
RIPPLE = 2.0
"""Ratio of the spectrum's own ripple to them, above which its motion changes."""
NARROWEST = 2.0
"""Narrowness above which a spectrum is not determined."""
STEADY = 0.9
"""Share of a recording that is the same motion as its median, if it is a steady one."""


class Motion(NamedTuple):
    """A steady motion, and the largest lasting energy of its healthy residual."""

    pace: float
    size: float
    narrow: float
    energy: float


class UsualError:
    """The largest healthy energy at each sample's motion, block by block.

    Args:
        limits: of the healthy residual, with the steady motions of commissioning.
        rate: sample rate [Hz].
    """

    def __init__(self, limits: HealthyLimits, rate: float) -> None:
        self._known = tuple(_known(limits))
        self._smooth = _Smooth(rate)

    def update(self, seen: Spectrum) -> FloatArray:
        """The energy after each sample, infinite where it is not known, shape (n,)."""
        smooth = self._smooth.update(seen)
        steady = np.abs(seen.pace - smooth.pace) <= RIPPLE * PACE * smooth.pace
        steady &= np.abs(seen.size - smooth.size) <= RIPPLE * SIZE * smooth.size
        found = np.zeros(seen.pace.size)
        for motion in self._known:
            same = _same(smooth, motion)
            found[same] = np.maximum(found[same], motion.energy)
        return np.where(steady & (found > 0.0), found, np.inf)


def steady_motion(seen: Spectrum, energy: float, rate: float) -> Motion | None:
    """The motion of a recording, None if it changes or is too short.

    Args:
        seen: the spectrum after the start.
        energy: largest lasting energy of the recording's residual.
        rate: sample rate [Hz].
    """
    if seen.pace.size == 0:
        return None
    smooth = _Smooth(rate).update(seen)
    pace, size, narrow = (float(np.median(x)) for x in (smooth.pace, smooth.size, smooth.narrow))
    middle = Motion(pace, size, narrow, energy)
    steady = size > 0.0 and float(np.mean(_same(smooth, middle))) >= STEADY
    return middle if steady else None


class _Smooth:
    """Carries the smoothing of a spectrum, which has a ripple of twice the motion's frequency."""

    def __init__(self, rate: float) -> None:
        self._share = 1.0 / (MEMORY * rate)
        self._kept: FloatArray | None = None

    def update(self, seen: Spectrum) -> Spectrum:
        # The first sample after a restart in motion has no change yet, and no bound narrowness.
        rows = np.stack([np.minimum(seen.narrow, NARROWEST), seen.pace, seen.size])
        share, kept = self._share, self._kept
        kept = (1.0 - share) * rows[:, :1] if kept is None else kept
        smooth, self._kept = lfilter([share], [1.0, share - 1.0], rows, zi=kept)
        return Spectrum(*smooth)


def _known(limits: HealthyLimits) -> Iterator[Motion]:
    shapes = zip(limits.steady_paces, limits.steady_sizes, limits.steady_narrow, strict=True)
    for (pace, size, narrow), energy in zip(shapes, limits.steady_energies, strict=True):
        yield Motion(pace, size, narrow, energy)


def _same(seen: Spectrum, motion: Motion) -> NDArray[np.bool_]:
    near = np.abs(seen.pace - motion.pace) <= PACE * motion.pace
    near &= np.abs(seen.size - motion.size) <= SIZE * motion.size
    return np.asarray(near & (np.abs(seen.narrow - motion.narrow) <= NARROW))
