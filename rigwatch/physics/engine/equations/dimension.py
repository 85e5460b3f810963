"""Physical dimensions of units, so that an equation that adds metres to volts is refused.

A dimension is the tuple of exponents of (kg, m, s, A, K, V): volts are counted as a base unit of
their own, since signals in volts are readings here and not energy per charge.
"""

import re
from fractions import Fraction

from rigwatch.wire.errors import ModelError

Dimension = tuple[Fraction, ...]

_BASES = ("kg", "m", "s", "A", "K", "V")
NONE: Dimension = (Fraction(0),) * len(_BASES)
"""Of a pure number."""


def _base(**exponents: int) -> Dimension:
    return tuple(Fraction(exponents.get(base, 0)) for base in _BASES)


_UNITS: dict[str, Dimension] = {
    **{base: _base(**{base: 1}) for base in _BASES},
    "1": NONE,
    "": NONE,
    "rad": NONE,
    "ppm": NONE,
    "%": NONE,
    "g": _base(kg=1),
    "N": _base(kg=1, m=1, s=-2),
    "J": _base(kg=1, m=2, s=-2),
    "W": _base(kg=1, m=2, s=-3),
    "Pa": _base(kg=1, m=-1, s=-2),
    "bar": _base(kg=1, m=-1, s=-2),
    "Hz": _base(s=-1),
    "mm": _base(m=1),
    "ms": _base(s=1),
    "mV": _base(V=1),
}
_TOKEN = re.compile(r"\s*(?:(?P<name>[A-Za-z%]+|1)(?:\^(?P<power>-?\d+))?|(?P<sign>[*/()]))")


def dimension(unit: str) -> Dimension:
    """The dimension of a unit such as "N s/m", "m/s^2" or "N/(m/s)".

    Raises:
        ModelError: a part of the unit is unknown.
    """
    return _product(_tokens(unit), unit)


def _tokens(unit: str) -> list[tuple[str, int]]:
    tokens, place = [], 0
    text = unit.strip()
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None or (match["name"] and match["name"] not in _UNITS):
            known = ", ".join(name for name in _UNITS if name)
            raise ModelError(f"unit: found {unit!r}, expected products of {known}")
        tokens.append((match["name"] or match["sign"], int(match["power"] or 1)))
        place = match.end()
    return tokens


def _product(tokens: list[tuple[str, int]], unit: str) -> Dimension:
    """Left to right; a division holds for the next factor only, which may stand in brackets."""
    total, power = NONE, 1
    while tokens:
        name, exponent = tokens.pop(0)
        if name == ")":
            break
        if name in "*/":
            power = -1 if name == "/" else 1
            continue
        factor = _product(tokens, unit) if name == "(" else _UNITS[name]
        total = times(total, factor, power * exponent)
        power = 1
    return total


def times(one: Dimension, other: Dimension, power: Fraction | int = 1) -> Dimension:
    """The dimension of one·otherᵖᵒʷᵉʳ."""
    return tuple(a + b * power for a, b in zip(one, other, strict=True))


def describe(dim: Dimension) -> str:
    """The dimension in base units, such as "kg m s^-2"; "1" for a pure number."""
    parts = [
        base if exponent == 1 else f"{base}^{exponent}"
        for base, exponent in zip(_BASES, dim, strict=True)
        if exponent
    ]
    return " ".join(parts) or "1"
