"""After how many samples a recording's excitation repeats, unchanged or with its sign inverted.

A multisine of odd lines inverts after half its period. What a wrong model leaves then repeats or
inverts, too, and so does its product with a sensitivity: repetitions hold no new information.
"""

import numpy as np

from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data.signals import Data

ALIKE = 0.95
"""Correlation with the delayed signal above which it counts as a repetition."""
LONGEST = 0.75
"""Largest delay as a share of the recording."""


def repeat_of(recording: Recording) -> int:
    """Smallest delay in samples after which all that drives the rig repeats or inverts; 0 if none.

    Args:
        recording: the recording.
    """
    drive = recording.excitation
    if drive.shape[1] == 0:
        return 0
    each = np.array([_correlation(signal) for signal in drive.T])
    size = np.maximum(each.min(axis=0), (-each).min(axis=0))
    falls = np.flatnonzero(size < 0.5)
    if not falls.size:
        return 0
    first, inner = int(falls[0]), size[1:-1]
    peaks = 1 + np.flatnonzero((inner >= ALIKE) & (inner >= size[:-2]) & (inner >= size[2:]))
    return int(next((lag for lag in peaks.tolist() if lag > first), 0))


def repeat_along_motion(data: Data) -> int:
    """`repeat_of` the training recording along its measured motion; 0 for free simulations.

    Args:
        data: the recordings.
    """
    counted = data.along_motion and data.train.thinning is None
    return repeat_of(data.train) if counted else 0


def _correlation(signal: FloatArray) -> FloatArray:
    """Correlation of a signal with itself by delay, up to the longest delay."""
    left = signal - signal.mean()
    n = len(left)
    spectrum = np.fft.rfft(left, 2 * n)
    together = np.fft.irfft(spectrum * spectrum.conj())[:n]
    energy = np.concatenate([[0.0], np.cumsum(left**2)])
    early, late = energy[n:0:-1], energy[n] - energy[:n]
    return np.asarray((together / np.sqrt(np.maximum(early * late, 1e-300)))[: int(LONGEST * n)])
