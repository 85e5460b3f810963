"""Unknowns of a search, moved so that decades of them are as near as shares of them.

An unknown that must be positive is moved by its logarithm, any other one over a size of its own,
each within its bounds. What the data do not say holds it near its centre, by a weak prior.
"""

from dataclasses import dataclass

import numpy as np

from rigwatch.wire.arrays import BoolArray, FloatArray

INSIDE = 1e-9
"""Distance from the bounds at which a search may begin."""
LEAST = 1e-4
"""Share of its centre to which an unknown with a lower bound of 0 may fall."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Each is centre·e^z where it is logarithmic, else centre + size·z.

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
        """The unknowns at a place of the search."""
        grown = self.centre * np.exp(np.where(self.logarithmic, z, 0.0))
        return np.where(self.logarithmic, grown, self.centre + self.size * z)

    def slope(self, z: FloatArray) -> FloatArray:
        """∂value/∂z."""
        return np.where(self.logarithmic, self.value(z), self.size)

    def inside(self, z: FloatArray) -> FloatArray:
        """The nearest place within the bounds."""
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
        positive: of the first so many, those that cannot be negative are moved by logarithms.
        sizes: how far one unit moves each of the others, shape (unknowns,); as `_sizes` has it
            where it is NaN, or None.
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
    """How far one unit moves an unknown: its value, else a tenth of its range, else 1."""
    span = np.where(np.isfinite(high - low), high - low, 10.0) / 10
    return np.where(values != 0, np.abs(values), np.where(span > 0, span, 1.0))
