"""What a logger's column headers say: a name and a unit.

speed_rad_s    speed [rad/s]    Speed (rpm)    accel_m_s2    time_ms    t
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rigwatch.wire.units import UnitError, unit_of

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")
_SEPARATED = re.compile(r"[\s_.\-]+")
_POWER = re.compile(r"^(?P<unit>[A-Za-zµΩ°%]+)(?P<power>\d)$")


@dataclass(frozen=True)
class Header:
    """A column as its header names it.

    Attributes:
        column: the header as it stands.
        name: what is measured, in lower case with `_` between words.
        units: what may be meant, as rigwatch writes it, the likeliest first; empty where the header
            tells none. `N_m` may be N/m or N m.
    """

    column: str
    name: str
    units: tuple[str, ...]


def read_header(column: str) -> Header:
    """The name and the units that a header tells."""
    if found := _BRACKETED.match(column):
        units = tuple(filter(_known, [found["unit"].strip()]))
        return Header(column, _plain(found["name"]), units)
    words = [word for word in _SEPARATED.split(column.strip()) if word]
    for first in range(1, len(words)):
        if units := tuple(filter(_known, _units(words[first:]))):
            return Header(column, _plain("_".join(words[:first])), units)
    return Header(column, _plain(column), ())


def _plain(name: str) -> str:
    return "_".join(word for word in _SEPARATED.split(name.strip().lower()) if word)


def _units(words: list[str]) -> Iterator[str]:
    """Units that words may stand for: the first over the others, or all of them together."""
    told = [_powered(word) for word in words if word.lower() != "per"]
    if len(told) == 2:
        yield "/".join(told)
    if told:
        yield " ".join(told)


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
