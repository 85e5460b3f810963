"""The noise of a residual as what does not repeat with the excitation, for any period.

A cyclic test repeats its excitation, hardly ever after a whole number of samples. What a wrong
model leaves repeats with it, also where it fills all bands as the spikes at reversals do, and noise
does not. So the residual r of each recording is fitted, in least squares, with all harmonics of the
period T that its sampling resolves,

    r[n] = Σ c_k exp(2πi k n/T) + e[n],   |k| < T/2,

and e is the noise, with the number of harmonics counted as degrees of freedom. The normal equations
are Toeplitz.
"""

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import minimize_scalar

from rigwatch.physics.engine.fit import Fit, Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data.repeats import repeat_of

FEWEST_PERIODS = 3
LOW_HARMONICS = 8
"""Harmonics by which the period is refined to a part of a sample."""
REPEATED = 0.05
"""Largest rms of what does not repeat of an input, its sensor's noise, over the input's own."""
LARGEST = 20_000_000
"""Samples times harmonics up to which they are fitted; the matrix of more fills the memory."""


def unrepeated(fitted: Fit, recording: Recording) -> tuple[FloatArray, float] | None:
    """Noise of each output, and the ratio to it that noise alone may reach.

    Args:
        fitted: a fit without windows, whose error is a function of the inputs.
        recording: the recordings that it was fitted to.

    Returns:
        None unless all inputs of each recording repeat at least three times, with the same period.
    """
    if len(fitted.residuals) != 1:
        return None
    factor = recording.thinning.factor if recording.thinning else 1
    lengths = counted_samples(recording)
    if sum(lengths) != fitted.residuals.shape[1]:
        return None
    parts = np.split(fitted.residuals[0], np.cumsum(lengths)[:-1])
    squares, freedom = np.zeros(fitted.residuals.shape[-1]), 0
    for part, own in zip(parts, recording.slices, strict=True):
        period = exact_period(recording, own) / factor
        counted = _without_ends(part)
        if not 2 < period <= len(counted) / FEWEST_PERIODS or not np.isfinite(counted).all():
            return None
        left, taken = _without_harmonics(counted, period)
        squares += np.sum(np.square(left), axis=0)
        freedom += len(counted) - taken
    return np.sqrt(squares / freedom), 1 + 3 / float(np.sqrt(2 * freedom))


def counted_samples(recording: Recording) -> list[int]:
    """Samples of the residual in each of the concatenated recordings."""
    factor = recording.thinning.factor if recording.thinning else 1
    edge = recording.thinning.edge if recording.thinning else 0
    return [-(-(own.stop - own.start) // factor) - 2 * edge for own in recording.slices]


def exact_period(recording: Recording, own: slice) -> float:
    """Period of all that drives the rig in one recording [samples]; 0 if it does not repeat.

    Args:
        recording: the recordings.
        own: samples of the one.
    """
    alone = recording.stretch(own.start, own.stop)
    drive = alone.excitation
    near = repeat_of(alone)
    if not near or not np.isfinite(drive).all():
        return 0.0
    if np.sum(drive[near:] * drive[:-near]) < 0:
        near *= 2
    if near * FEWEST_PERIODS > len(drive) + 1 or near * len(drive) > LARGEST:
        return 0.0

    def size(period: float) -> float:
        return float(np.sum(np.square(_without_harmonics(drive, period, LOW_HARMONICS)[0])))

    found = minimize_scalar(size, bounds=(near - 1.0, near + 1.0), method="bounded")
    left, _ = _without_harmonics(drive, float(found.x))
    repeats = np.all(left.std(axis=0) <= REPEATED * drive.std(axis=0))
    return float(found.x) if repeats else 0.0


def _without_ends(part: FloatArray) -> FloatArray:
    """A residual (n, outputs) without the samples at its ends that do not count."""
    known = np.flatnonzero(np.isfinite(part).all(axis=1))
    return part[known[0] : known[-1] + 1] if len(known) else part[:0]


def _without_harmonics(
    signals: FloatArray, period: float, most: int = LARGEST
) -> tuple[FloatArray, int]:
    """What the harmonics of a period leave of signals (n, signals), and how many terms they have.

    Args:
        signals: finite.
        period: more than 2 [samples].
        most: harmonics, fewer if the sampling resolves fewer.
    """
    highest = min(int((period - 1) / 2), most)
    turns = np.exp(2j * np.pi / period * np.arange(len(signals)))
    # All of the matrix lie on its diagonals, which differ in the order of the harmonic.
    column = np.array([np.sum(turns ** -float(k)) for k in range(2 * highest + 1)])
    orders = np.arange(-highest, highest + 1)
    basis = turns[:, None] ** orders
    found = solve_toeplitz((column, column.conj()), basis.conj().T @ signals)
    return np.asarray(signals - (basis @ found).real, np.float64), len(orders)
