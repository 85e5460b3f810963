"""The kinds of drive and motion that healthy recordings contain, and which of them are judged.

Each signal of a square wave at another frequency is within the range of commissioning, but a
voltage that lasts longer at the same speed is not, and equations fitted elsewhere are less accurate
there. A kind is the pace of the drive, which tells shapes apart, together with the mean frequency
of the motion. Its size is none of it: a fault may enlarge the motion.
"""

from collections.abc import Sequence

import numpy as np

from monitor.model import RangeSection
from monitor.observer.spectral_width import Spectrum
from rigwatch.wire.arrays import FloatArray

CELL = 0.05
"""Width of a kind, in the logarithm of both figures."""
DRIVE, MOTION = 0.3, 0.15
"""Distance of a judged kind from one that was seen, in the same logarithms: sines stand for
triangles, and neither for a square.
"""
LEAST = 0.05
"""Size of a motion, relative to the largest, below which it is none."""
TONE = 0.75
"""Narrowness below which a motion is broadband noise, which has no kind."""
FARTHEST = 10.0
"""Largest distance that is told apart, where 1 is the limit."""
AT_ONCE = 1024
"""Motions that are compared with all kinds at once: a recording has 10⁵, and hundreds of kinds."""


def kinds_of(
    motions: Sequence[Spectrum], drives: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Paces of drives, and mean frequencies of their motions, in healthy recordings.

    Args:
        motions: spectra of each recording after its start.
        drives: pace of the drive of each, see `monitor.drives.Drive`.
    """
    motion = Spectrum(*(np.concatenate(part) for part in zip(*motions, strict=True)))
    drive = np.concatenate(drives)
    moves = (drive > 0.0) & (motion.size > LEAST * motion.size.max(initial=0.0))
    cells = np.rint(_logarithms(drive[moves], motion.pace[moves]) / CELL)
    paces = np.exp(CELL * np.unique(cells, axis=0))
    return paces[:, 0], paces[:, 1]


class DrivesSeen:
    """Compares motions with the kinds in a model file; files of earlier versions contain none."""

    def __init__(self, seen: RangeSection) -> None:
        self._cells = _logarithms(np.array(seen.drive_paces), np.array(seen.motion_paces))

    def distance(self, motion: Spectrum, drive: FloatArray) -> FloatArray:
        """Distance of each motion from the nearest kind, 1 at the limit, shape (n,)."""
        found = np.zeros(drive.size)
        judged = (drive > 0.0) & (motion.pace > 0.0) & (motion.narrow >= TONE)
        if self._cells.size and judged.any():
            own = _logarithms(drive[judged], motion.pace[judged])
            parts = (own[first : first + AT_ONCE] for first in range(0, len(own), AT_ONCE))
            found[judged] = np.concatenate([self._nearest(part) for part in parts])
        return found

    def _nearest(self, own: FloatArray) -> FloatArray:
        away = np.abs(own[:, None] - self._cells) / (DRIVE, MOTION)
        return np.asarray(np.minimum(away.max(axis=2).min(axis=1), FARTHEST))


def _logarithms(drive: FloatArray, pace: FloatArray) -> FloatArray:
    return np.log(np.column_stack([drive, pace]))
