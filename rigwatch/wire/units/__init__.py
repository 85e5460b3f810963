"""Units: one table of quantities with exact factors, and parsing of texts such as "kN/mm"."""

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
from rigwatch.wire.units.unit_table import IN_OTHER_WORDS, Dimension

__all__ = [
    "GRAM",
    "IN_OTHER_WORDS",
    "NONE",
    "Dimension",
    "Unit",
    "UnitError",
    "describe",
    "names_gram",
    "times",
    "unit_of",
]
