"""Axes: data to pixels, round ticks, limits that include all values."""

from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np

from rigwatch.wire.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Scale:
    """Maps data to pixels along one axis.

    Attributes:
        low, high: ends of the data.
        start, end: the same in pixels.
        log: whether the axis is logarithmic.
    """

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def at(self, value: float) -> float:
        """The pixel of a value."""
        low, high, x = self.low, self.high, value
        if self.log:
            low, high, x = log10(low), log10(high), log10(max(value, 1e-300))
        return self.start + (x - low) / (high - low) * (self.end - self.start)

    def ticks(self, count: int = 5) -> list[float]:
        """Round values within the ends."""
        if self.log:
            return _decades(self.low, self.high)
        step = _round_step((self.high - self.low) / count)
        first, last = ceil(self.low / step - 1e-9), floor(self.high / step + 1e-9)
        return [k * step for k in range(first, last + 1)]


def _round_step(rough: float) -> float:
    power = 10.0 ** floor(log10(rough))
    return next(power * m for m in (1, 2, 5, 10) if power * m >= rough * 0.999)


def _decades(low: float, high: float) -> list[float]:
    first, last = ceil(log10(low) - 1e-9), floor(log10(high) + 1e-9)
    every = max(1, ceil((last - first + 1) / 7))
    return [10.0**k for k in range(first, last + 1, every)]


def limits(*values: FloatArray, zero: bool = False, room: float = 0.06) -> tuple[float, float]:
    """Limits of an axis for all finite values, with a margin."""
    every = np.concatenate([np.ravel(v) for v in values])
    every = every[np.isfinite(every)]
    if not every.size:
        return 0.0, 1.0
    low, high = float(every.min()), float(every.max())
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    spare = room * (high - low or abs(high) or 1.0)
    return (low if zero and low == 0 else low - spare), (
        high if zero and high == 0 else high + spare
    )


def label(value: float) -> str:
    """The label of a tick."""
    text = f"{value:.4g}"
    return text.replace("e-0", "e-").replace("e+0", "e").replace("-", "−")
