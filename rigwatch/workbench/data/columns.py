"""Channels of a session over equally spaced samples."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rigwatch.physics.engine.fit import filled
from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Columns:
    """Channels over equally spaced samples.

    Attributes:
        dt: time between samples [s].
        values: by channel, each of shape (n,), in SI; NaN for invalid samples.
        units: of the channels as recorded.
        altered: how the samples differ from what was measured, in words.
        passed: frequency up to which signals are not low-passed, over the rate.
    """

    dt: float
    values: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)
    altered: tuple[str, ...] = ()
    passed: float = 0.5

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def bridged(signal: FloatArray) -> FloatArray:
    """The signal with gaps (NaN) interpolated linearly; unchanged if it has no valid sample."""
    return filled(signal) if np.isfinite(signal).any() else signal
