"""The range of motion that a model was fitted to, and the distance of a sample from it."""

from collections.abc import Mapping, Sequence

import numpy as np

from monitor.model import RangeSection, RigModel
from monitor.observer.drives_seen import DrivesSeen, kinds_of
from monitor.observer.lagged_motion import EMPTY
from monitor.observer.missing_force import PREDICTED
from monitor.observer.model_signals import Observed
from monitor.observer.spectral_width import SpectralWidth, Spectrum
from rigwatch.wire.arrays import FloatArray

ALLOWED = 1.2
"""Half width of the judged range, relative to that of the fitted range."""
WIDER = 0.25
"""Spectral broadening that is always judged: that of a tone by drive changes and faults."""
FASTER = 1.1
"""Largest judged mean frequency, relative to the largest fitted for a motion of that size."""
LEVELS, LEVEL_STEP = 24, 1.1
"""Number of motion sizes distinguished, and ratio of successive sizes."""
PREDICTION = "predicted"
"""Name of the high-passed prediction among the signals of a range."""


class RangeSeen:
    """Judges samples by the range in the model file, block by block.

    Args:
        model: with a range, and the speed that cannot be distinguished from rest.
        speed: index of the speed among inputs and motion.
    """

    def __init__(self, model: RigModel, speed: int) -> None:
        assert model.motion_range is not None
        assert model.healthy is not None
        self._speed = speed
        self._width = SpectralWidth(model.healthy.speed_noise, model.sample_rate)
        self._wider = max(ALLOWED * (1.0 - model.motion_range.narrow), WIDER)
        low, high = np.array(model.motion_range.low), np.array(model.motion_range.high)
        self._middle = 0.5 * (low + high)
        self._half = ALLOWED * np.maximum(0.5 * (high - low), 1e-12)
        self._sizes = np.array(model.motion_range.sizes)
        self._paces = np.array([*model.motion_range.paces, np.inf])
        self._kinds = DrivesSeen(model.motion_range)

    def motion(self, seen: Observed) -> Spectrum:
        """The spectrum of the motion after each sample; once for each block."""
        return self._width.update(np.ascontiguousarray(seen.rows[:, self._speed]), seen.state)

    def distance(self, seen: Observed, motion: Spectrum) -> FloatArray:
        """Distance from the fitted range, 1 at the limit, shape (n,).

        It is the largest of: distance of a signal from the centre, width of the spectrum compared
        with a tone's, mean frequency compared with the largest for a motion of that size, and
        kind of drive and motion compared with those seen.
        """
        signals = range_signals(seen)
        far = (np.abs(signals - self._middle) / self._half).max(axis=1)
        far = np.maximum(far, (1.0 - motion.narrow) / self._wider)
        known = self._paces[np.searchsorted(self._sizes, motion.size / ALLOWED)]
        far = np.maximum(far, motion.pace / (FASTER * known))
        far = np.maximum(far, self._kinds.distance(motion, seen.drive))
        return np.where(seen.state == EMPTY, 0.0, far)


def range_signals(seen: Observed) -> FloatArray:
    """Inputs, motion and prediction, shape (n, signals)."""
    return np.column_stack([seen.rows, seen.judged[:, PREDICTED]])


def drive_energy(rows: FloatArray, seen: RangeSection, motions: Sequence[int]) -> FloatArray:
    """Squared inputs other than motion, 1 at the edge of their range, shape (n,)."""
    inputs = [place for place in range(rows.shape[1]) if place not in motions]
    low, high = np.array(seen.low)[inputs], np.array(seen.high)[inputs]
    scaled = (rows[:, inputs] - 0.5 * (low + high)) / np.maximum(0.5 * (high - low), 1e-12)
    return np.asarray((scaled**2).sum(axis=1))


def range_of(
    names: Sequence[str],
    parts: Sequence[FloatArray],
    motions: Sequence[Spectrum],
    drives: Sequence[FloatArray],
    bends: Mapping[str, float],
) -> RangeSection:
    """The range of healthy signals.

    Args:
        names: of the signals.
        parts: of each recording, shape (n, signals).
        motions: spectra of each recording after its start.
        drives: paces of the drive after each start.
        bends: largest differences of channels that measure a state.
    """
    every = np.concatenate(parts)
    narrow, pace, size, *_ = (np.concatenate(part) for part in zip(*motions, strict=True))
    sizes = size.max(initial=0.0) / LEVEL_STEP ** np.arange(LEVELS)[::-1]
    drive_paces, motion_paces = kinds_of(motions, drives)
    return RangeSection(
        names=(*names, PREDICTION),
        low=tuple(every.min(axis=0).tolist()),
        high=tuple(every.max(axis=0).tolist()),
        narrow=float(np.clip(narrow.min(initial=1.0), 0.0, 1.0)),
        sizes=tuple(sizes.tolist()),
        paces=tuple(float(pace[size >= least].max(initial=0.0)) for least in sizes),
        drive_paces=tuple(drive_paces.tolist()),
        motion_paces=tuple(motion_paces.tolist()),
        channels=tuple(bends),
        bends=tuple(bends.values()),
    )
