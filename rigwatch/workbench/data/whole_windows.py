"""Recordings in whole windows: their ends.

A recording seldom ends where a window does. If at least half of the last window is recorded, and
the study says so, it counts: the inputs stay at their last values until its end, where no output
counts. Less than that is left out, since a window's own initial state would take most of it. A
study says so where its horizon was chosen; others divide their recordings as they always have.
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data.prediction import predicts_along_motion
from rigwatch.workbench.study import Study

LEAST = 0.5
"""Share of the last window that must be recorded."""


def counted_length(study: Study, samples: int, horizon: int) -> int:
    """Samples of a recording in whole windows; all of them for a model without windows.

    Args:
        study: only windows of its free runs may end after the recording.
        samples: of the recording.
        horizon: samples of a window.
    """
    if not study.model.states:
        return samples
    whole = samples // horizon * horizon
    free = not (study.file.thin or study.model.rough or predicts_along_motion(study))
    if study.file.half_windows and free and whole and samples - whole >= LEAST * horizon:
        return whole + horizon
    return whole


def of_length(length: int, signals: FloatArray, *, filler: FloatArray | float) -> FloatArray:
    """Signals of shape (n, signals), cut to a length, or continued with a filler up to it."""
    if length <= len(signals):
        return signals[:length]
    rest = np.broadcast_to(filler, (length - len(signals), signals.shape[1]))
    return np.concatenate([signals, rest])


def last_values(signals: FloatArray) -> FloatArray:
    """The last valid value of each signal, NaN if it has none; shape (signals,)."""
    valid = [column[np.isfinite(column)] for column in signals.T]
    return np.array([column[-1] if len(column) else np.nan for column in valid])
