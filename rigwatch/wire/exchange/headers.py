"""Name and unit from a logger's column header.

speed_rad_s    speed [rad/s]    Speed (rpm)    accel_m_s2    time_ms    Time (sec)    Heater 1
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rigwatch.wire.units import IN_OTHER_WORDS, UnitError, unit_of

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")
_SEPARATED = re.compile(r"[\s_.\-]+")
_POWER = re.compile(r"^(?P<unit>[A-Za-zµΩ°%]+)(?P<power>\d)$")


@dataclass(frozen=True)
class Header:
    """A column header.

    Attributes:
        column: the header as written.
        name: the quantity, in lower case with `_` between words.
        units: possible units in rigwatch's notation, the likeliest first; empty without a unit.
            `N_m` may be N/m or N m.
    """

    column: str
    name: str
    units: tuple[str, ...]


def read_header(column: str) -> Header:
    """Name and possible units from a header."""
    if found := _BRACKETED.match(column):
        units = tuple(filter(_known, [_usual(found["unit"].strip())]))
        return Header(column, _plain(found["name"]), units)
    words = [word for word in _SEPARATED.split(column.strip()) if word]
    for first in range(1, len(words)):
        if units := tuple(filter(_known, _units(words[first:]))):
            return Header(column, _plain("_".join(words[:first])), units)
    return Header(column, _plain(column), ())


def _plain(name: str) -> str:
    return "_".join(word for word in _SEPARATED.split(name.strip().lower()) if word)


def _units(words: list[str]) -> Iterator[str]:
    """Units that words may mean: the first divided by the others, or their product.

    A number counts columns, as in `Heater 1`.
    """
    if any(word.isdecimal() for word in words):
        return
    told = [_powered(_usual(word)) for word in words if word.lower() != "per"]
    if len(told) == 2:
        yield "/".join(told)
    if told:
        yield " ".join(told)


def _usual(word: str) -> str:
    """The symbol of a unit that is spelt out: s for `sec` or `Seconds`."""
    return word if _known(word) else IN_OTHER_WORDS.get(word.lower(), word)


def _powered(word: str) -> str:
    """`s2` is s^2; words that are units already stay."""
    found = _POWER.match(word)
    return f"{found['unit']}^{found['power']}" if found and not _known(word) else word


def _known(unit: str) -> bool:
    if not unit:
        return False
    try:
        unit_of(unit)
    except UnitError:
        return False
    return True
