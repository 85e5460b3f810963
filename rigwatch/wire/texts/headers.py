"""Name and unit from a logger's column header.

speed_rad_s    speed [rad/s]    Speed (rpm)    Speed [RPM] (avg)    time_ms    t    Heater 1
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rigwatch.wire.units import in_table_words, is_unit, unit_of

_BRACKETED = re.compile(r"\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()\[\]]*)\)")
_SEPARATED = re.compile(r"[\s_.\-]+")
_PER = re.compile(r"\bper\b", re.IGNORECASE)
_POWER = re.compile(r"^(?P<unit>[A-Za-zµΩ°%]+)(?P<power>\d)$")


@dataclass(frozen=True)
class Header:
    """A column header.

    Attributes:
        column: the header as written.
        name: the quantity, in lower case with `_` between words.
        units: possible units in rigwatch's notation, the likeliest first; empty without a unit.
            `N_m` may be N/m or N m.
        unknown: what stands in brackets, if nothing in the header is a unit.
    """

    column: str
    name: str
    units: tuple[str, ...]
    unknown: str = ""


def read_header(column: str) -> Header:
    """Name and possible units from a header."""
    bracketed = [in_table_words(text) for text in _bracketed(column)]
    plain = _BRACKETED.sub(" ", column).strip()
    if known := next(filter(is_unit, filter(None, bracketed)), None):
        return Header(column, _plain(plain), (known,))
    words = [word for word in _SEPARATED.split(plain) if word]
    if words and _is_clock(words):
        return Header(column, _plain(plain), (in_table_words(words[0]),))
    for first in range(1, len(words)):
        if units := tuple(filter(is_unit, _units(words[first:]))):
            return Header(column, _plain("_".join(words[:first])), units)
    return Header(column, _plain(plain), (), next(filter(None, _bracketed(column)), ""))


def _is_clock(words: list[str]) -> bool:
    """Whether a header is a unit of time by its full name and nothing else: millis, micros."""
    unit = in_table_words(words[0])
    spelled = len(words) == 1 and unit != words[0]
    return spelled and is_unit(unit) and unit_of(unit).dimension == unit_of("s").dimension


def _bracketed(column: str) -> list[str]:
    """What stands in brackets, in square ones first."""
    found = list(_BRACKETED.finditer(column))
    texts = [match["square"] for match in found] + [match["round"] for match in found]
    return [text.strip() for text in texts if text is not None]


def _plain(name: str) -> str:
    return "_".join(word for word in _SEPARATED.split(name.strip().lower()) if word)


def _units(words: list[str]) -> Iterator[str]:
    """Units that words may mean: as `per` divides them, else the first by the second, or a product.

    A number counts columns, as in `Heater 1`.
    """
    if any(word.isdecimal() for word in words):
        return
    told = [_powered(in_table_words(word)) for word in words]
    if "per" in map(str.lower, words):
        yield _divided(" ".join(told))
        return
    if len(told) == 2:
        yield "/".join(told)
    if told:
        yield " ".join(told)


def _divided(told: str) -> str:
    """`N per mm s` is N/(mm s), and `per rad` 1/rad."""
    over, *under = (part.strip() for part in _PER.split(told))
    return "/".join([over or "1", *(f"({part})" if " " in part else part for part in under)])


def _powered(word: str) -> str:
    """`s2` is s^2; words that are units already stay."""
    found = _POWER.match(word)
    return f"{found['unit']}^{found['power']}" if found and not is_unit(word) else word
