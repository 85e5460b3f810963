"""Units: one table of quantities with exact factors, and what a text such as "kN/mm" means."""

from rigwatch.wire.units.unit import (
    GRAM,
    NONE,
    Unit,
    UnitError,
    describe,
    names_gram,
    times,
    unit_of,
)
from rigwatch.wire.units.unit_table import Dimension

__all__ = [
    "GRAM",
    "NONE",
    "Dimension",
    "Unit",
    "UnitError",
    "describe",
    "names_gram",
    "times",
    "unit_of",
]
