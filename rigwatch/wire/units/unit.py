"""Units in common notation: their dimension, and conversion of values to SI.

"N s/m", "kN/mm", "m/s^2", "N/(m/s)" and "l/min" are units: products by a space, * or ·, quotients
by /, which applies to the next factor only, powers by ^, such as m^2 or V^(1/2). All files are
converted on reading with the same table; internally all numbers are SI. A temperature by itself is
absolute (degC has an offset); within a product it is a difference.
"""

import difflib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.units.unit_table import BASES, ENTRIES, IN_OTHER_WORDS, Dimension, Entry

JOINED = ("kg", "rad", "ohm", "Pa", "Hz", "N", "m", "s", "V", "A", "W", "K", "J")
"""Units that people write as one word with others."""

NONE: Dimension = (Fraction(0),) * len(BASES)
"""Of a pure number."""
_GRAM = re.compile(r"(?<![A-Za-z])(m?)g(?![A-Za-z0-9])")
GRAM = "the unit g is the gram, write g0 for standard gravity"
_POWER = r"-?\d+(?:\.\d+)?|\(-?\d+(?:\.\d+|/[1-9]\d?)?\)"
_EXPONENT = rf"(?:(?:\^|\*\*)(?P<{{0}}>{_POWER}))?"
_TOKEN = re.compile(
    rf"\s*(?:(?P<name>°?[A-Za-zµΩ%]+\d*|°|1){_EXPONENT.format('power')}"
    rf"|(?P<close>\)){_EXPONENT.format('closed')}|(?P<sign>[*/(]))\s*"
)
_RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_SAME = str.maketrans({"μ": "µ", "Ω": "Ω", "·": "*", "⋅": "*", "×": "*", "−": "-"})


class UnitError(RigwatchError, ValueError):
    """A unit is unknown or malformed; also a ValueError, so that msgspec adds its location.

    Args:
        found: the text found.
        expected: the text expected.
    """

    def __init__(self, found: str, expected: str) -> None:
        self.found, self.expected = found, expected
        super().__init__(f"found {found}, expected {expected}")


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit.

    Attributes:
        si: the SI unit of converted values.
        dimension: exponents of the base units.
        factor: SI value of one unit, exact.
        offset: SI value of its zero.
    """

    si: str
    dimension: Dimension
    factor: Fraction
    offset: Fraction = Fraction(0)

    @property
    def plain(self) -> bool:
        """Whether values are SI without conversion."""
        return self.factor == 1 and self.offset == 0

    def to_si(self, value: float) -> float:
        """The value in SI: 5.1 bar are 510000 Pa; SI values are unchanged to the bit."""
        if self.plain or not math.isfinite(value):
            return value
        return float(Fraction(repr(float(value))) * self.factor + self.offset)

    def from_si(self, value: float) -> float:
        """The SI value in this unit: 0.0007 m are 0.7 mm."""
        if self.plain or not math.isfinite(value):
            return value
        return float((Fraction(repr(float(value))) - self.offset) / self.factor)


@lru_cache(maxsize=4096)
def unit_of(text: str) -> Unit:
    """The unit that `text` names.

    Raises:
        UnitError: a part of it is unknown.
    """
    written = _plainly(text)
    single = ENTRIES.get(written)
    if single is not None:
        return Unit(single.si, single.dimension, single.factor, single.offset)
    tokens = _tokens(written)
    si = _si_text(tokens)
    dimension, factor = _product(tokens, text, depth=0)
    return Unit(si, dimension, factor)


def is_unit(text: str) -> bool:
    """Whether `text` names a unit."""
    try:
        unit_of(text)
    except UnitError:
        return False
    return True


def _plainly(text: str) -> str:
    """The text with superscripts and look-alike characters replaced by plain ones."""
    raised = re.sub("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda m: "^" + m[0].translate(_RAISED), text.strip())
    return raised.translate(_SAME)


@dataclass(frozen=True, slots=True)
class _Token:
    """A unit by its `entry`, or the sign `name`."""

    name: str
    entry: Entry | None
    power: Fraction


def _tokens(text: str) -> list[_Token]:
    found, place = [], 0
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            broken = f"the unit {text!r}, which cannot be read from {text[place:]!r} on"
            raise UnitError(broken, "one such as N s/m or kN/mm^2")
        found.append(_token(match, text))
        place = match.end()
    return found


def _token(match: re.Match[str], text: str) -> _Token:
    name, power = match["name"], match["power"]
    if name is None:
        sign = ")" if match["close"] else match["sign"]
        return _Token(sign, None, _exponent(match["closed"]))
    if name not in ENTRIES and power is None:
        # "m/s2" is how many programs write a power.
        letters = name.rstrip("0123456789")
        name, power = letters, name[len(letters) :] or None
    if name not in ENTRIES:
        raise _unknown(name, text)
    return _Token(name, ENTRIES[name], _exponent(power))


def _exponent(text: str | None) -> Fraction:
    """An exponent such as "2", "0.5" or "(1/2)"; 1 without one."""
    return Fraction((text or "1").strip("()"))


def _si_text(tokens: Sequence[_Token]) -> str:
    """The product in SI units."""
    found, before = "", ""
    for token in tokens:
        si = token.entry.si if token.entry else token.name
        if token.entry and re.search("[ /^]", si) and (before == "/" or token.power != 1):
            si = f"({si})"
        joined = token.name in (")", "*", "/") or before in ("", "(", "*", "/")
        found += (
            ("" if joined else " ") + si + (f"^{float(token.power):g}" if token.power != 1 else "")
        )
        before = token.name
    return found


def _product(tokens: list[_Token], unit: str, depth: int) -> tuple[Dimension, Fraction]:
    """The product, left to right; a division applies to the next factor or bracket only."""
    dimension, factor, sign = NONE, Fraction(1), 1
    while tokens:
        token = tokens.pop(0)
        if token.name in ("*", "/"):
            sign = -1 if token.name == "/" else 1
            continue
        if token.name == ")" and depth:
            return times(NONE, dimension, token.power), _raised(factor, token.power)
        if token.name == ")":
            depth = -1
            break
        if token.entry is None:
            inner = _product(tokens, unit, depth + 1)
        else:
            size = _raised(token.entry.factor, token.power)
            inner = times(NONE, token.entry.dimension, token.power), size
        dimension, factor = times(dimension, inner[0], sign), factor * inner[1] ** sign
        sign = 1
    if depth:
        raise UnitError(f"the unit {unit!r}", "as many '(' as ')'")
    return dimension, factor


def simplified(text: str) -> str:
    """A unit with its brackets multiplied out: (N m)/((rad/s)*(rad/s)) is N m s^2/rad^2.

    Nothing stays nothing.

    Raises:
        UnitError: a part of it is unknown.
    """
    if not text:
        return ""
    powers = _powers(_tokens(_plainly(text)))
    above = [_raised_text(name, power) for name, power in powers.items() if power > 0]
    below = [_raised_text(name, -power) for name, power in powers.items() if power < 0]
    divided = f"/({' '.join(below)})" if len(below) > 1 else "".join(f"/{one}" for one in below)
    return (" ".join(above) or "1") + divided


def _powers(tokens: list[_Token]) -> dict[str, Fraction]:
    """The exponents of a product's units, by their names; takes the tokens up to its bracket."""
    found, sign = dict[str, Fraction](), 1
    while tokens:
        token = tokens.pop(0)
        if token.name == ")":
            return {name: power * token.power for name, power in found.items()}
        if token.name in ("*", "/"):
            sign = -1 if token.name == "/" else 1
            continue
        inner = _powers(tokens) if token.entry is None else {token.name: token.power}
        for name, power in inner.items():
            found[name] = found.get(name, Fraction(0)) + sign * power
        sign = 1
    found.pop("1", None)
    return found


def _raised_text(name: str, power: Fraction) -> str:
    return name if power == 1 else f"{name}^{_written(power)}"


def _raised(factor: Fraction, power: Fraction) -> Fraction:
    return factor ** int(power) if power.denominator == 1 else Fraction(float(factor) ** power)


def _unknown(name: str, text: str) -> UnitError:
    within = "" if name == text else f" in {text!r}"
    # A name with a figure in it, such as cmH2O, is no power.
    meant = _meant(text if text.lower() in IN_OTHER_WORDS else name)
    return UnitError(f"the unknown unit {name!r}{within}", f"a known one: {meant}")


def _meant(name: str) -> str:
    lower = name.lower()
    if lower in IN_OTHER_WORDS:
        return f"did you mean {IN_OTHER_WORDS[lower]!r}?"
    if apart := _written_apart(name):
        return f"did you mean {apart!r}?"
    same = [known for known in ENTRIES if known.lower() == lower]
    same.sort(key=lambda known: sum(a != b for a, b in zip(name, known, strict=True)))
    close = same or difflib.get_close_matches(name, ENTRIES, 1)
    if close:
        return f"did you mean {close[0]!r}?"
    return "m, mm, kg, s, N, Pa, bar, V, A, ohm, rad or K, among others"


def _written_apart(name: str) -> str:
    """Units that are written as one word, such as "N m s^2" of "Nms2"; empty if it is no such."""
    parts = re.findall(f"({'|'.join(JOINED)})([0-9]?)", name)
    different = len(parts) > 1 and len(dict(parts)) == len(parts)
    if not different or "".join(map("".join, parts)) != name:
        return ""
    return " ".join(unit + (f"^{power}" if power else "") for unit, power in parts)


def times(one: Dimension, other: Dimension, power: Fraction | int = 1) -> Dimension:
    """The dimension of one·otherᵖᵒʷᵉʳ."""
    return tuple(a + b * power if b else a for a, b in zip(one, other, strict=True))


def describe(dim: Dimension) -> str:
    """The dimension in base units, such as "kg m s^-2"; "1" for a pure number."""
    parts = [
        base if exponent == 1 else f"{base}^{_written(exponent)}"
        for base, exponent in zip(BASES, dim, strict=True)
        if exponent
    ]
    return " ".join(parts) or "1"


def _written(exponent: Fraction) -> str:
    return f"{exponent}" if exponent.denominator == 1 else f"({exponent})"


def names_gram(text: str) -> bool:
    """Whether a unit contains the symbol of the gram, often misread as standard gravity."""
    return bool(_GRAM.search(text))


def with_gravity(text: str) -> str:
    """A unit with standard gravity in place of the gram."""
    return _GRAM.sub(r"\1g0", text)
