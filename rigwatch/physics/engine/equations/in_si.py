"""Numbers of models and effects become SI where they are made, from a file or in Python.

A value is given in the unit that stands beside it. From then on `unit` is SI, as the numbers are,
and `shown` keeps the unit as it was written, for everything that people read. What is SI already
stays untouched, to the bit, so that a copy of a section changes nothing.
"""

import re
from collections.abc import Callable
from typing import Any

from msgspec.structs import force_setattr

from rigwatch.wire.typed_files import Section
from rigwatch.wire.units import UnitError, describe, unit_of


def into_si(section: Section, *numbers: str) -> None:
    """Turn the numbers and the unit of a section that is being made into SI.

    A unit that names a port's in braces waits until they are filled in; see `Effect.at`.

    Args:
        section: has `unit` and `shown`.
        numbers: fields that are given in `unit`.

    Raises:
        UnitError: a unit is unknown, or `shown` measures something else than `unit`.
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
