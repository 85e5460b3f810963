"""Units as loggers and people write them beside a column: RPM, U/min, Volt, rad/sec, min-1.

Files of rigwatch itself are read strictly; a header that is not understood would leave its column
without a unit.
"""

import re

from rigwatch.wire.units.unit import NONE, is_unit, unit_of, with_gravity
from rigwatch.wire.units.unit_table import BASES, ENTRIES, IN_OTHER_WORDS

WHOLE = {
    "u/min": "rpm", "upm": "rpm", "r/min": "rpm", "r.p.m.": "rpm", "tr/min": "rpm", "-": "1",
    "lb-ft": "ft lbf", "ft-lb": "ft lbf", "lb-in": "inch lbf", "in-lb": "inch lbf",
}  # fmt: skip
"""Spellings of whole units, in lower case."""
DEGREES = {"C": "degC", "F": "degF"}
"""Temperatures as loggers abbreviate them, where nothing else would be one."""
_WORD = re.compile(r"[A-Za-zµ°]+")
_NEGATIVE = re.compile(r"(?<=[A-Za-z])[-−](?=\d)")
_PRODUCT = re.compile(r"(?<=[A-Za-z])-(?=[A-Za-z])")
_SHORTEST = 3
"""Letters of the shortest unit that is known in any case: Nm and nm, mV and MV differ."""
_ANGLE = re.compile(r"rad|deg|rpm|rev|°")
_TIME = BASES.index("s")


def in_table_words(text: str) -> str:
    """The unit in the table's words; a text that is no unit is returned unchanged."""
    written = text.strip()
    if written in ENTRIES:
        return written
    if whole := WHOLE.get(written.lower()) or IN_OTHER_WORDS.get(written.lower()):
        return whole
    powers = _NEGATIVE.sub("^-", _PRODUCT.sub(" ", written))
    return _WORD.sub(lambda match: _table_word(match[0]), powers)


def _table_word(word: str) -> str:
    lower = word.lower()
    if word in ENTRIES:
        return word
    if known := IN_OTHER_WORDS.get(lower):
        return f"({known})" if "/" in known else known
    alike = [name for name in ENTRIES if name.lower() == lower]
    alike = [name for name in alike if name[0] == word[0]] or alike
    return alike[0] if len(alike) == 1 and len(word) >= _SHORTEST else word


def as_meant(unit: str, wanted: str) -> str:
    """A column's unit as it is meant for a quantity of the unit `wanted`; empty if it is another's.

    An accelerometer's g is standard gravity, and C or F beside a temperature are degrees.
    """
    dimension = unit_of(wanted).dimension
    readings = (unit, with_gravity(unit), DEGREES.get(unit, unit))
    return next((r for r in readings if is_unit(r) and unit_of(r).dimension == dimension), "")


def may_count_turns(one: str, other: str) -> bool:
    """Whether `one` may count turns in a time where `other` has an angle, as 1/min and rad/s.

    They are of one dimension, but a factor 2π may lie between them.

    Raises:
        UnitError: `one` is no unit.
    """
    if _ANGLE.search(one) or not _ANGLE.search(other):
        return False
    dimension = unit_of(one).dimension
    return dimension != NONE and not any(dimension[:_TIME] + dimension[_TIME + 1 :])
