"""Compares the measured acceleration with the one that the model predicts from the drive.

    ratio = ± rms of the measured / rms of the modelled acceleration

negative where the two move against each other. A wrong unit or gain of the drive's channel, or a
device of another rig, changes the size; a reversed drive changes the sign. Friction and a model
that fits one frequency better than another change it by less than a factor of two.
"""

import numpy as np

from rigwatch.wire.arrays import FloatArray

SHOWS = 3.0
"""Size of the modelled acceleration over the residual's noise from which a drive is there."""
AGAINST = -0.9
"""Correlation below which the two move against each other."""


def drive_ratio(measured: FloatArray, modelled: FloatArray, noise: float) -> float | None:
    """The ratio over one window; None if the drive is too small to tell.

    Args:
        measured, modelled: accelerations [m/s^2], shape (n,).
        noise: standard deviation of a healthy residual [m/s^2].
    """
    a, m = measured - measured.mean(), modelled - modelled.mean()
    size = float(np.sqrt(np.mean(m**2)))
    if not np.isfinite(size) or size < SHOWS * noise:
        return None
    ratio = float(np.sqrt(np.mean(a**2))) / size
    against = float(a @ m) < AGAINST * len(a) * ratio * size**2
    return -ratio if against else ratio
