"""The noise that rounding makes of readings: a converter shows no difference below its step.

Under an excitation that repeats a quiet channel repeats as well, step by step, and the differences
between its periods vanish. What rounding has taken is no less unknown: of a signal that moves by
many steps q it is spread evenly over one, with a standard deviation of q/√12 (B. Widrow, I. Kollár,
Quantization Noise, 2008).
"""

import math

import numpy as np

from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.arrays import FloatArray

SAME = 1e-9
"""Relative difference of two readings that is due to the conversion of units."""


def rounding(recording: Recording) -> FloatArray:
    """Standard deviation of what rounding has taken of each output, shape (outputs,).

    The step is the smallest difference of two readings. Of a channel that is not rounded, it is far
    below its noise.

    Args:
        recording: as measured; the residuals may be decimated.
    """
    kept = recording.thinning.kept if recording.thinning else 1.0
    steps = [_step(column) for column in recording.outputs.T]
    return np.array(steps, np.float64) * math.sqrt(kept / 12)


def _step(column: FloatArray) -> float:
    """Smallest difference of two readings that differ; 0 if all are the same."""
    readings = np.unique(column[np.isfinite(column)])
    apart = np.diff(readings)
    apart = apart[apart > SAME * float(np.max(np.abs(readings), initial=0.0))]
    return float(np.min(apart, initial=np.inf)) if len(apart) else 0.0
