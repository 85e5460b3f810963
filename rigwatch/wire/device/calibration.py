"""Converts raw codes to SI values and back: value = gain · code + offset, per channel."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.rig_config import ChannelSection


@dataclass(frozen=True, slots=True)
class Calibration:
    """The channels' calibration as arrays of shape (channels,).

    Attributes:
        gain: SI units per code.
        offset: SI value at code 0.
        code_low, code_high: rails of the converter.
        low, high: limits of the sensor's range [SI], infinite if there are none.
    """

    gain: FloatArray
    offset: FloatArray
    code_low: FloatArray
    code_high: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, channels: Sequence[ChannelSection]) -> "Calibration":
        """The calibration from the configuration of `channels`."""
        return cls(
            gain=np.array([channel.gain for channel in channels], np.float64),
            offset=np.array([channel.offset for channel in channels], np.float64),
            code_low=np.array([channel.code_low for channel in channels], np.float64),
            code_high=np.array([channel.code_high for channel in channels], np.float64),
            low=_ends([channel.low for channel in channels], -np.inf),
            high=_ends([channel.high for channel in channels], np.inf),
        )

    def values(self, codes: ArrayLike) -> FloatArray:
        """SI values of `codes`, shape (n, channels)."""
        return np.asarray(codes, np.float64) * self.gain + self.offset

    def codes(self, values: ArrayLike) -> FloatArray:
        """Codes of a converter without rails for `values`, shape (n, channels)."""
        return np.rint((np.asarray(values, np.float64) - self.offset) / self.gain)


def _ends(ends: Sequence[float | None], without: float) -> FloatArray:
    return np.array([without if end is None else end for end in ends], np.float64)
