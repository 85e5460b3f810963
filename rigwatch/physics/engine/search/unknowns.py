"""Unknowns of a search, scaled so that it can cover decades.

A positive unknown is varied by its logarithm, any other relative to its own size, each within its
bounds. A weak prior keeps undetermined unknowns near their centre.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import BoolArray, FloatArray

INSIDE = 1e-9
"""Smallest distance from the bounds at the start of a search."""
LEAST = 1e-4
"""Smallest value of an unknown with a lower bound of 0, as a share of its centre."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Unknowns: centre·e^z if logarithmic, otherwise centre + size·z.

    Attributes:
        centre, size: shape (unknowns,).
        logarithmic: shape (unknowns,).
        low, high: bounds of z, shape (unknowns,).
    """

    centre: FloatArray
    size: FloatArray
    logarithmic: BoolArray
    low: FloatArray
    high: FloatArray

    def value(self, z: FloatArray) -> FloatArray:
        """The unknowns at a point z of the search."""
        grown = self.centre * np.exp(np.where(self.logarithmic, z, 0.0))
        return np.where(self.logarithmic, grown, self.centre + self.size * z)

    def slope(self, z: FloatArray) -> FloatArray:
        """∂value/∂z."""
        return np.where(self.logarithmic, self.value(z), self.size)

    def inside(self, z: FloatArray) -> FloatArray:
        """The nearest point within the bounds."""
        return np.clip(z, self.low + INSIDE, self.high - INSIDE)


def unknowns(
    centre: FloatArray,
    low: FloatArray,
    high: FloatArray,
    positive: int,
    sizes: FloatArray | None = None,
) -> Unknowns:
    """Unknowns about their centre.

    Args:
        centre, low, high: shape (unknowns,).
        positive: number of leading unknowns; nonnegative ones among them are logarithmic.
        sizes: units of the other unknowns, shape (unknowns,); the default of `_sizes` if NaN, or
            None for all.
    """
    centre = np.clip(centre, low, high)
    logarithmic = (low >= 0) & (centre > 0) & (np.arange(len(centre)) < positive)
    size = _sizes(centre, low, high)
    if sizes is not None:
        size = np.where(np.isfinite(sizes), sizes, size)
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.log(np.maximum(low, LEAST * centre) / centre)
        most = np.log(high / centre)
    return Unknowns(
        centre,
        size,
        logarithmic,
        np.minimum(np.where(logarithmic, least, (low - centre) / size), -1e-6),
        np.maximum(np.where(logarithmic, most, (high - centre) / size), 1e-6),
    )


def _sizes(values: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Size of each unknown: its value, otherwise a tenth of its range, otherwise 1."""
    span = np.where(np.isfinite(high - low), high - low, 10.0) / 10
    return np.where(values != 0, np.abs(values), np.where(span > 0, span, 1.0))
