"""Converts numbers of models and effects to SI on creation, from a file or in Python.

A value is given in the unit next to it. After conversion numbers and `unit` are SI, and `shown`
keeps the original unit for display. Values already in SI are left unchanged to the bit, so copying
a section changes nothing.
"""

import re
from collections.abc import Callable
from typing import Any

from msgspec.structs import force_setattr

from rigwatch.wire.typed_files import Section
from rigwatch.wire.units import UnitError, describe, unit_of


def into_si(section: Section, *numbers: str) -> None:
    """Convert the numbers and the unit of a new section to SI.

    A unit with references in braces is converted later, see `Effect.at`.

    Args:
        section: has `unit` and `shown`.
        numbers: fields that are given in `unit`.

    Raises:
        UnitError: a unit is unknown, or `shown` has another dimension than `unit`.
    """
    one: Any = section
    if "{" in one.unit:
        unit_of(re.sub(r"\{\w*\}", "1", one.unit))
        return
    unit, shown = unit_of(one.unit), unit_of(one.shown or one.unit)
    if unit.dimension != shown.dimension:
        expected = f"a unit in {describe(unit.dimension)}, as {one.unit!r} is"
        raise UnitError(f"the unit {one.shown!r} to show it in", expected)
    if unit.plain:
        return
    for name in numbers:
        force_setattr(section, name, _converted(getattr(one, name), unit.to_si))
    force_setattr(section, "shown", one.shown or one.unit)
    force_setattr(section, "unit", unit.si)


def _converted(value: Any, convert: Callable[[float], float]) -> Any:
    return tuple(map(convert, value)) if isinstance(value, tuple) else convert(value)
