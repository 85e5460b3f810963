"""The range of motion that a model was fitted to, and how far a sample lies beyond it."""

from collections.abc import Mapping, Sequence

import numpy as np

from monitor.model import RangeSection, RigModel
from monitor.observer.lagged_motion import EMPTY
from monitor.observer.missing_force import PREDICTED
from monitor.observer.model_signals import Observed
from monitor.observer.spectral_width import SpectralWidth, Spectrum
from rigwatch.wire.arrays import FloatArray

ALLOWED = 1.2
"""Half width of what is judged, in half the width of what was fitted."""
WIDER = 0.25
"""Broadening that is always judged: what changes of the drive and faults do to a tone."""
FASTER = 1.1
"""Mean frequency that is judged, over the largest that was fitted of a motion of that size."""
LEVELS, LEVEL_STEP = 24, 1.1
"""Sizes of motion that are told apart, and the ratio of two of them."""
PREDICTION = "predicted"
"""What the high-passed prediction is called among the signals of a range."""


class RangeSeen:
    """Judges samples by the range in the model file, block by block.

    Args:
        model: with a range, and the speed that cannot be told from rest.
        speed: place of the speed among inputs and motion.
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

    def distance(self, seen: Observed) -> FloatArray:
        """Largest of: distance of a signal from the middle, of the spectrum's width from a tone's,
        mean frequency against what was seen of a motion of that size; 1 at the limit, shape (n,).
        """
        signals = range_signals(seen)
        far = (np.abs(signals - self._middle) / self._half).max(axis=1)
        motion = self._width.update(np.ascontiguousarray(seen.rows[:, self._speed]), seen.state)
        far = np.maximum(far, (1.0 - motion.narrow) / self._wider)
        known = self._paces[np.searchsorted(self._sizes, motion.size / ALLOWED)]
        far = np.maximum(far, motion.pace / (FASTER * known))
        return np.where(seen.state == EMPTY, 0.0, far)


def range_signals(seen: Observed) -> FloatArray:
    """Inputs, motion and prediction, shape (n, signals)."""
    return np.column_stack([seen.rows, seen.judged[:, PREDICTED]])


def drive_energy(rows: FloatArray, seen: RangeSection, motions: Sequence[int]) -> FloatArray:
    """Square of the inputs that are no motion, 1 at the edge of their range, shape (n,)."""
    inputs = [place for place in range(rows.shape[1]) if place not in motions]
    low, high = np.array(seen.low)[inputs], np.array(seen.high)[inputs]
    scaled = (rows[:, inputs] - 0.5 * (low + high)) / np.maximum(0.5 * (high - low), 1e-12)
    return np.asarray((scaled**2).sum(axis=1))


def range_of(
    names: Sequence[str],
    parts: Sequence[FloatArray],
    motions: Sequence[Spectrum],
    bends: Mapping[str, float],
) -> RangeSection:
    """The range of healthy signals.

    Args:
        names: of the signals.
        parts: of each recording, shape (n, signals).
        motions: spectra of each recording once it has begun.
        bends: largest differences of channels that show a state.
    """
    every = np.concatenate(parts)
    narrow, pace, size = (np.concatenate(part) for part in zip(*motions, strict=True))
    sizes = size.max(initial=0.0) / LEVEL_STEP ** np.arange(LEVELS)[::-1]
    return RangeSection(
        names=(*names, PREDICTION),
        low=tuple(every.min(axis=0).tolist()),
        high=tuple(every.max(axis=0).tolist()),
        narrow=float(np.clip(narrow.min(initial=1.0), 0.0, 1.0)),
        sizes=tuple(sizes.tolist()),
        paces=tuple(float(pace[size >= least].max(initial=0.0)) for least in sizes),
        channels=tuple(bends),
        bends=tuple(bends.values()),
    )
