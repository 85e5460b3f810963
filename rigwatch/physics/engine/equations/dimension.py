"""Physical dimensions of units, to refuse equations such as metres plus volts.

A dimension is the tuple of exponents of (kg, m, s, A, K); volts are kg m² s⁻³ A⁻¹, so that kt²/R of
a motor has the unit of a damping. The table of units is that of `rigwatch.wire.units`.
"""

from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import (
    GRAM,
    NONE,
    Dimension,
    UnitError,
    describe,
    names_gram,
    times,
    unit_of,
)

__all__ = ["GRAM", "NONE", "Dimension", "describe", "dimension", "names_gram", "times"]


def dimension(unit: str) -> Dimension:
    """The dimension of a unit such as "N s/m", "m/s^2" or "N/(m/s)".

    Raises:
        ModelError: a part of the unit is unknown.
    """
    try:
        return unit_of(unit).dimension
    except UnitError as error:
        raise ModelError(f"unit: {error}") from None
