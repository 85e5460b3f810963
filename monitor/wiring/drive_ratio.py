"""Compares the measured acceleration with the one that the model predicts from the drive.

    ratio = ± rms of the measured / rms of the modelled acceleration

negative where the two move against each other. A wrong unit or gain of the drive's channel, or a
device of another rig, changes the size; a reversed drive changes the sign. Friction and a model
that fits one frequency better than another change it by less than a factor of two.
"""

import numpy as np

from monitor.model import RigModel, TransferPlant
from monitor.signals import modelled_acceleration, usable
from rigwatch.physics.transfer import Filter
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.messages import SampleBlock

SHOWS = 3.0
"""Size of the modelled acceleration over the residual's noise from which a drive is there."""
AGAINST = -0.9
"""Correlation below which the two move against each other."""


class ModelledDrive:
    """The acceleration that a transfer function predicts from the drive alone.

    Args:
        model: its plant is a transfer function, its first channel the drive.
    """

    def __init__(self, model: RigModel) -> None:
        assert isinstance(model.plant, TransferPlant)
        self._channel = model.channels[0]
        self._function, _ = modelled_acceleration(model.plant, model.sample_rate)
        self.restart()

    def restart(self) -> None:
        """The next sample does not follow the last one."""
        self._filter, self._last = Filter(self._function), 0.0

    def update(self, block: SampleBlock) -> FloatArray:
        """The prediction [m/s^2], NaN where the drive is not known, shape (n,)."""
        column = block.channel(self._channel)
        valid = usable(column, stuck_counts=True)
        held = np.maximum.accumulate(np.where(valid, np.arange(len(block)), -1))
        drive = np.where(held < 0, self._last, column.values[held])
        self._last = float(drive[-1])
        return np.where(valid, self._filter.update(drive), np.nan)


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
