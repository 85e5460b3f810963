"""Units: one table of quantities with exact factors, and parsing of texts such as "kN/mm"."""

from rigwatch.wire.units.spellings import as_meant, in_table_words, may_count_turns
from rigwatch.wire.units.unit import (
    GRAM,
    NONE,
    Unit,
    UnitError,
    describe,
    is_unit,
    names_gram,
    simplified,
    times,
    unit_of,
    with_gravity,
)
from rigwatch.wire.units.unit_table import Dimension

__all__ = [
    "GRAM",
    "NONE",
    "Dimension",
    "Unit",
    "UnitError",
    "as_meant",
    "describe",
    "in_table_words",
    "is_unit",
    "may_count_turns",
    "names_gram",
    "simplified",
    "times",
    "unit_of",
    "with_gravity",
]
