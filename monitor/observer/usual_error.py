"""The healthy residual's extremes at the present motion.

What equations leave of a healthy rig depends on the motion and hardly on anything else. A steady
motion that was recorded at commissioning is therefore compared with what was left of it then,
which is far less than the worst of all motions. A smaller motion of the same kind, as faults of the
drive cause, leaves no more than that. Under a drive that was recorded a healthy rig moves as it did
then, so that any other steady motion is compared with that recording as well, and that its size is
another one is evidence of a change by itself. Inputs that act later shift the motion and leave its
size and shape as they were; more mass, a spring or a lower supply look the same in its phase, and
change either. A mass that drifts aside while it oscillates, as by a
wave whose edges jitter, is only known by that drive. Of all others, and while the motion changes,
the extremes of a healthy rig are not known.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from monitor.drives import same_drive
from monitor.model import BANDS, HealthyLimits
from monitor.observer.spectral_width import MEMORY, Spectrum
from rigwatch.wire.arrays import FloatArray

PACE, SIZE, NARROW = 0.03, 0.1, 0.03
"""Differences up to which motions are the same: relative in frequency and size, in narrowness."""
DRIVE = 0.025
"""Relative difference of the drives' paces up to which they are the same: that of a triangle is 3
to 10 % above a sine's, that of a square more.
"""
SKEWS = slice(Spectrum._fields.index("skew"), None)
"""Rows of a spectrum that are skewnesses."""
SMALLEST = 0.6
"""Ratio of a smaller motion to a recorded one down to which it leaves no more."""
RIPPLE = 2.0
"""Ratio of the spectrum's own ripple to them, above which its motion changes."""
NARROWEST = 2.0
"""Narrowness above which a spectrum is not determined."""
DRIFTS = 0.0
"""Narrowness of a motion that drifts, of which it varies, as does the mean frequency: only its
drive tells it from others.
"""
STEADY = 0.9
"""Share of a recording that is the same motion as its median, if it is a steady one."""
STEEPEST = 6.0
"""Largest relative change of a healthy motion's size over that of its drive's frequency, and of its
shape.
"""
SHIFTED_SIZE, SHIFTED_SHAPE, VARIES, FAINT = 0.03, 0.1, 3.0, 0.004
"""Relative differences of size and skewnesses up to which a motion is the recorded one, shifted.
Besides, skewnesses may differ by a multiple of what those of the recording usually vary by, and by
what the steps of a coarse sensor make of a motion that is sampled at other instants.
"""


class Extremes(NamedTuple):
    """Largest values of a healthy residual: energies of three windows, friction, and evidence of
    its onset.

    In the order of `USUAL_LASTING` and so on in `decision_state.py`.
    """

    lasting: float
    short: float = np.inf
    medium: float = np.inf
    friction: float = np.inf
    onset: float = np.inf


NO_DRIVE = (0.0,) * BANDS
"""Energies of a drive that is not a steady one."""


class Shape(NamedTuple):
    """Skewnesses of a motion's speed and of its rate, and what they vary by; NaN if not known."""

    skew: float = np.nan
    skew_rate: float = np.nan
    spread: float = np.nan


class Motion(NamedTuple):
    """A steady motion, the extremes of its healthy residual, and energies of the drive's bands.

    The energies are zeros if the drive is not a steady one.
    """

    pace: float
    size: float
    narrow: float
    drive: float
    extremes: Extremes
    bands: tuple[float, ...] = NO_DRIVE
    shape: Shape = Shape()


class Usual(NamedTuple):
    """What a healthy rig does at the motion of each sample.

    Attributes:
        extremes: of the residual, infinite where they are not known, shape (5, n).
        response: deviation of the motion's size from that under the same drive, 1 at its limit, 0
            where the drive was not recorded, shape (n,).
        altered: the same of its size and shape, from what later inputs leave of them.
    """

    extremes: FloatArray
    response: FloatArray
    altered: FloatArray


class UsualError:
    """The extremes of the healthy residual at each sample's motion, block by block.

    Args:
        limits: of the healthy residual, with the steady motions of commissioning.
        rate: sample rate [Hz].
    """

    def __init__(self, limits: HealthyLimits, rate: float) -> None:
        self._known = tuple(_known(limits))
        self._smooth = _Smooth(rate)

    def update(self, seen: Spectrum, drive: FloatArray, bands: FloatArray) -> Usual:
        """What is usual after each sample.

        Args:
            seen: the motion.
            drive: its pace, see `monitor.drives.Drive`.
            bands: its energies, see `monitor.drives.DriveBands`, shape (n, BANDS).
        """
        smooth = self._smooth.update(seen)
        steady = np.abs(seen.pace - smooth.pace) <= RIPPLE * PACE * smooth.pace
        steady &= np.abs(seen.size - smooth.size) <= RIPPLE * SIZE * smooth.size
        settled = steady & (np.abs(seen.size - smooth.size) <= SIZE * smooth.size)
        found, smaller, driven = np.zeros((3, len(Extremes._fields), seen.pace.size))
        for motion in self._known:
            alike, ratio = _alike(smooth, drive, bands, motion), smooth.size / motion.size
            same = alike & (np.abs(ratio - 1.0) <= SIZE)
            found[:, same] = np.maximum(found[:, same], np.array(motion.extremes)[:, None])
            less = alike & (ratio >= SMALLEST) & (ratio < 1.0 - SIZE)
            smaller[:, less] = np.maximum(smaller[:, less], _no_more(motion.extremes, ratio[less]))
            other = settled & (ratio > 1.0 + SIZE) & _driven(bands, motion)
            driven[:, other] = np.maximum(driven[:, other], np.array(motion.extremes)[:, None])
        for known in (smaller, driven):
            found = np.where(found > 0.0, found, known)
        extremes = np.where(steady & (found > 0.0), found, np.inf)
        return Usual(extremes, *self._responses(smooth, settled, drive, bands))

    def _responses(
        self, smooth: Spectrum, settled: NDArray[np.bool_], drive: FloatArray, bands: FloatArray
    ) -> FloatArray:
        """`response` and `altered` of `Usual`, shape (2, n)."""
        nearest = np.full((2, settled.size), np.inf)
        size, energy = np.maximum(smooth.size, 1e-300), bands.sum(axis=1)
        for motion in self._known:
            faster = np.abs(drive - motion.drive) / max(motion.drive, 1e-300)
            same = settled & _driven(bands, motion) & (faster <= DRIVE)
            healthy = motion.size * np.sqrt(energy[same] / max(sum(motion.bands), 1e-300))
            slope, off = STEEPEST * faster[same], np.abs(np.log(size[same] / healthy))
            shape = _reshaped(smooth, slope, same, motion.shape)
            found = [
                off / np.log1p(SIZE + slope),
                np.hypot(off / np.log1p(SHIFTED_SIZE + slope), shape),
            ]
            nearest[:, same] = np.minimum(nearest[:, same], found)
        return np.where(np.isfinite(nearest), nearest, 0.0)


def steady_motion(
    seen: Spectrum,
    drive: FloatArray,
    extremes: Extremes,
    rate: float,
    bands: tuple[float, ...] = (),
) -> Motion | None:
    """The motion of a recording, None if it changes or is too short.

    Args:
        seen: the spectrum after the start.
        drive: the pace of the drive after the start.
        extremes: of the recording's residual.
        rate: sample rate [Hz].
        bands: energies of the drive, if it is a steady one.
    """
    if seen.pace.size == 0:
        return None
    smooth = _Smooth(rate).update(seen)
    pace, size, narrow = (float(np.median(x)) for x in (smooth.pace, smooth.size, smooth.narrow))
    middle = Motion(
        pace, size, narrow, float(np.median(drive)), extremes, bands or NO_DRIVE, _shape_of(smooth)
    )
    as_large = np.abs(smooth.size - size) <= SIZE * size
    if size > 0.0 and np.mean(as_large & _of_kind(smooth, drive, middle)) >= STEADY:
        return middle
    drifts = size > 0.0 and np.mean(as_large & _as_driven(drive, middle)) >= STEADY
    return middle._replace(narrow=DRIFTS) if bands and drifts else None


class _Smooth:
    """Carries the smoothing of a spectrum, which has a ripple of twice the motion's frequency.

    Its skewnesses have one of the motion's own frequency and are smoothed twice.
    """

    def __init__(self, rate: float) -> None:
        self._share = 1.0 / (MEMORY * rate)
        self._kept: FloatArray | None = None
        self._again: FloatArray | None = None

    def update(self, seen: Spectrum) -> Spectrum:
        # The first sample after a restart in motion has no change yet, and no bound narrowness.
        rows = np.stack([np.minimum(seen.narrow, NARROWEST), *seen[1:]])
        share, kept = self._share, self._kept
        kept = (1.0 - share) * rows[:, :1] if kept is None else kept
        by = [share], [1.0, share - 1.0]
        smooth, self._kept = scipy.signal.lfilter(*by, rows, zi=kept)
        again = (1.0 - share) * smooth[SKEWS, :1] if self._again is None else self._again
        smooth[SKEWS], self._again = scipy.signal.lfilter(*by, smooth[SKEWS], zi=again)
        return Spectrum(*smooth)


def _known(limits: HealthyLimits) -> Iterator[Motion]:
    # Model files of earlier versions do not tell drives apart, and have the lasting energy only.
    count = len(limits.steady_paces)
    drives = limits.steady_drives or (0.0,) * count
    bands = np.reshape(limits.steady_motion_bands or NO_DRIVE * count, (-1, BANDS))
    spectra = limits.steady_paces, limits.steady_sizes, limits.steady_narrow
    motions = zip(*spectra, drives, strict=True)
    windows = (
        limits.steady_shorts, limits.steady_mediums, limits.steady_frictions, limits.steady_onsets,
    )  # fmt: skip
    unknown = (np.inf,) * count
    extremes = zip(limits.steady_energies, *(each or unknown for each in windows), strict=True)
    skews = np.reshape(limits.steady_skews or (np.nan,) * 3 * count, (-1, 3))
    for spectrum, largest, own, skew in zip(motions, extremes, bands, skews, strict=True):
        yield Motion(*spectrum, Extremes(*largest), tuple(own.tolist()), Shape(*skew.tolist()))


def _shape_of(smooth: Spectrum) -> Shape:
    """The shape of a recorded motion, and what it usually varies by."""
    skew, rate = float(np.median(smooth.skew)), float(np.median(smooth.skew_rate))
    off = np.hypot(smooth.skew - skew, smooth.skew_rate - rate)
    return Shape(skew, rate, float(np.median(off)))


def _reshaped(
    seen: Spectrum, slope: FloatArray, at: NDArray[np.bool_], healthy: Shape
) -> FloatArray:
    """Deviation of a motion's shape from the recorded one, 1 at its limit; 0 if that is not known.

    Args:
        seen: the motion.
        slope: relative difference that a faster drive may make, shape (compared samples,).
        at: the samples that are compared, shape (n,).
        healthy: the recorded one.
    """
    if np.isnan(healthy.spread):
        return np.zeros(slope.size)
    off = np.hypot(seen.skew[at] - healthy.skew, seen.skew_rate[at] - healthy.skew_rate)
    allowed = (SHIFTED_SHAPE + slope) * np.hypot(healthy.skew, healthy.skew_rate)
    return np.asarray(off / (allowed + VARIES * healthy.spread + FAINT))


def _driven(bands: FloatArray, motion: Motion) -> NDArray[np.bool_]:
    """Whether the drive is that of a motion."""
    if sum(motion.bands) == 0.0:
        return np.zeros(len(bands), np.bool_)
    return same_drive(bands, np.array(motion.bands))


def _no_more(known: Extremes, ratio: FloatArray) -> FloatArray:
    """Extremes of smaller motions that leave as much, shape (5, n).

    They are relative to the healthy variance, which falls at most as the square of the size.
    """
    energy = ratio**-2.0
    return np.stack(
        [
            np.full(ratio.size, np.inf),
            known.short * energy,
            known.medium * energy,
            known.friction * np.sqrt(energy),
            known.onset * np.sqrt(energy),
        ]
    )


def _alike(
    seen: Spectrum, drive: FloatArray, bands: FloatArray, motion: Motion
) -> NDArray[np.bool_]:
    """Whether a motion is the same but for its size."""
    if motion.narrow == DRIFTS:
        return _as_driven(drive, motion) & _driven(bands, motion)
    return _of_kind(seen, drive, motion)


def _of_kind(seen: Spectrum, drive: FloatArray, motion: Motion) -> NDArray[np.bool_]:
    near = np.abs(seen.pace - motion.pace) <= PACE * motion.pace
    near &= np.abs(seen.narrow - motion.narrow) <= NARROW
    return near & _as_driven(drive, motion)


def _as_driven(drive: FloatArray, motion: Motion) -> NDArray[np.bool_]:
    near = np.abs(drive - motion.drive) <= DRIVE * motion.drive
    return np.asarray(near | (motion.drive == 0.0))
