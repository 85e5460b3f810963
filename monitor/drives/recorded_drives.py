"""Drives that healthy recordings contain: the energy of an input in each of a few bands.

A motion larger than any recorded is evidence of a fault where its drive was recorded, and a motion
that equations do not describe where it was not. Bands tell sizes, frequencies and shapes apart
whatever the drive is, and a generator on its own clock is the same drive.
"""

from collections.abc import Sequence

import numpy as np

from monitor.model import BANDS
from monitor.signals import DEAD, NEW_BOOT, RESTART, Codes, fill
from rigwatch.wire.arrays import BoolArray, FloatArray
from rigwatch.wire.kernel import kernel

TIMES = tuple(2.0**octave for octave in range(BANDS - 1))
"""Time constants of the low-passes between bands [samples]."""
MEMORY = 128.0
"""Samples over which energies are averaged; a tone leaves a ripple."""
ALIKE, FAINT = 0.1, 0.01
"""Difference of energies that are the same, relative to the band's and to the sum of all."""
STEADY = 0.9
"""Share of a recording that has the energies of its median, if its drive is a steady one."""


class DriveBands:
    """Follows one input, block by block."""

    def __init__(self) -> None:
        self._kept = np.zeros(2 * BANDS)

    def update(self, signal: FloatArray, code: Codes) -> FloatArray:
        """Recent energies of an input of shape (n,), shape (n, BANDS)."""
        found = np.zeros((code.size, BANDS))
        _advance(np.ascontiguousarray(signal), code, np.array(TIMES), self._kept, found)
        return found


class RecordedDrives:
    """Compares energies with those in a model file; files of earlier versions contain none.

    Args:
        known: energies of each steady drive, one drive after the other.
    """

    def __init__(self, known: Sequence[float]) -> None:
        self._known = np.reshape(known, (-1, BANDS))

    def contain(self, energies: FloatArray) -> BoolArray:
        """Whether a drive was recorded, shape (n,), from its energies, shape (n, BANDS)."""
        found = np.zeros(len(energies), np.bool_)
        for drive in self._known:
            found |= same_drive(energies, drive)
        return found


def steady_energies(energies: FloatArray) -> tuple[float, ...]:
    """Energies of a recording's drive after its start; none if the drive is none, or changes."""
    if not energies.size:
        return ()
    middle = np.median(energies, axis=0)
    steady = middle.sum() > 0.0 and float(np.mean(same_drive(energies, middle))) >= STEADY
    return tuple(middle.tolist()) if steady else ()


def same_drive(energies: FloatArray, drive: FloatArray) -> BoolArray:
    """Whether energies, shape (n, BANDS), are those of a drive, shape (BANDS,)."""
    near = np.abs(energies - drive) <= ALIKE * drive + FAINT * drive.sum()
    return np.asarray(near.all(axis=1))


@kernel()
def _advance(
    signal: FloatArray, code: Codes, times: FloatArray, kept: FloatArray, found: FloatArray
) -> None:
    """`kept` holds what each low-pass passes, then the energies."""
    bands = times.size + 1
    for k in range(code.size):
        if code[k] == RESTART or code[k] == NEW_BOOT:
            fill(kept, 0.0)
        if code[k] != DEAD:
            left = signal[k]
            for band in range(bands):
                passed = 0.0
                if band < times.size:
                    kept[band] += (left - kept[band]) / (1.0 + times[band])
                    passed = kept[band]
                part = left - passed
                kept[bands + band] += (part * part - kept[bands + band]) / MEMORY
                left = passed
        for band in range(bands):
            found[k, band] = kept[bands + band]
