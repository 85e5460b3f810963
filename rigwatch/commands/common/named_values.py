"""Options of the form NAME=VALUE, where a value may have a unit: m=0.141[kg]."""

import re
from collections.abc import Mapping, Sequence

_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_WITH_UNIT = re.compile(_NUMBER + r"\s*\[([^\]]+)\]")
_BARE_UNIT = re.compile(r"(.+=)\s*" + _NUMBER + r"\s*([^\d\s\[].*)")


def named_values(
    option: str, given: Sequence[str], example: str, units: Mapping[str, str]
) -> dict[str, float]:
    """The numbers of an option that may be repeated, by name, each in the unit of its name.

    Args:
        option: its name, for errors.
        given: texts of the form NAME=VALUE or NAME=VALUE[UNIT].
        example: one, for errors.
        units: unit of each name; a name that is not among them may have no unit.

    Raises:
        ModelError: a text has another form, or its unit is not of the name's kind.
    """
    from rigwatch.wire.errors import ModelError

    found = {}
    for text in given:
        name, _, value = (part.strip() for part in text.partition("="))
        number = number_in_unit(f"{option} {text}", name, value, units)
        if number is None:
            expected = f"expected NAME=VALUE such as {example}"
            raise ModelError(f"{option}: found {text!r}, {expected}{hint_of_unit(text)}")
        found[name] = number
    return found


def hint_of_unit(text: str) -> str:
    """What to add to an error where a text has a unit without brackets, as m=141 g; or nothing."""
    bare = _BARE_UNIT.fullmatch(text.strip())
    return f"; a unit stands in brackets: '{bare[1]}{bare[2]}[{bare[3]}]'" if bare else ""


def number_in_unit(option: str, name: str, value: str, units: Mapping[str, str]) -> float | None:
    """The number that a text states, in the unit of its name; None if it states none.

    Args:
        option: the option and its text, for errors.
        name: of the quantity.
        value: a number, or a number and its unit in brackets.
        units: unit of each name.

    Raises:
        ModelError: the unit is unknown or not of the name's kind, or the name is unknown.
    """
    from rigwatch.wire.errors import ModelError, nearest
    from rigwatch.wire.units import UnitError, unit_of

    with_unit = _WITH_UNIT.fullmatch(value)
    if with_unit is None:
        try:
            return float(value)
        except ValueError:
            return None
    if name not in units:
        raise ModelError(f"{option}: found {name!r}{nearest(name, dict(units))}")
    wanted = unit_of(units[name])
    try:
        own = unit_of(with_unit[2])
    except UnitError as error:
        raise ModelError(f"{option}: {error}") from None
    if own.dimension != wanted.dimension:
        raise ModelError(f"{option}: found {with_unit[2]}, expected a unit like {units[name]}")
    return wanted.from_si(own.to_si(float(with_unit[1])))
