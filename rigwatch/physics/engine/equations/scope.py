"""The names that an expression may use, each with its meaning and its dimension."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy

from rigwatch.physics.engine.equations.expression import parse
from rigwatch.physics.engine.equations.expression_dimension import (
    dimension,
    dimension_of,
    has_bare_number,
)
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import GRAM, Dimension, describe, names_gram, with_gravity

BARE_NUMBER = (
    "a number has no unit: make it a parameter, such as"
    ' g = { value = 9.81, unit = "m/s^2", fixed = true }'
)


def symbol(name: str) -> sympy.Symbol:
    """The real symbol named `name`."""
    return sympy.Symbol(name, real=True)


@dataclass
class Scope:
    """Meanings and dimensions by name, in which an expression is read."""

    meanings: dict[str, sympy.Expr] = field(default_factory=dict)
    dimensions: dict[str, Dimension] = field(default_factory=dict)
    grams: dict[str, str] = field(default_factory=dict)
    """Units written with g, possibly meant as standard gravity, by the names that have them."""

    def define(self, name: str, meaning: sympy.Expr, unit: str | Dimension) -> None:
        """Define `name` as `meaning`, with its unit or dimension."""
        self.meanings[name] = meaning
        self.dimensions[name] = dimension(unit) if isinstance(unit, str) else unit
        if isinstance(unit, str) and names_gram(unit):
            self.grams[name] = unit

    def define_all(self, units: Mapping[str, str]) -> None:
        """Define each name as a symbol of its own."""
        for name, unit in units.items():
            self.define(name, symbol(name), unit)

    def copy(self) -> "Scope":
        """An independent copy of this scope."""
        return Scope(dict(self.meanings), dict(self.dimensions), dict(self.grams))

    def read(self, text: str, unit: str | Dimension, where: str) -> sympy.Expr:
        """The expression `text`, which must have the given unit or dimension.

        Raises:
            ModelError: it does not parse, uses an unknown name or has another dimension.
        """
        expression = parse(text, self.meanings, where)
        try:
            found = dimension_of(text, self.dimensions, where)
        except ModelError as error:
            raise ModelError(f"{error}{self._hint(text, unit)}") from None
        expected = dimension(unit) if isinstance(unit, str) else unit
        if found is not None and found != expected:
            raise ModelError(
                f"{where}: found {text!r} in {describe(found)}, expected {describe(expected)}"
                f"{self._hint(text, unit)}"
            )
        return expression

    def _hint(self, text: str, unit: str | Dimension) -> str:
        """A hint for a wrong unit that a gram for gravity, or a number without a unit, explains."""
        if self._suits_with_gravity(text, unit):
            return f" ({GRAM})"
        return f" ({BARE_NUMBER})" if has_bare_number(text) else ""

    def _suits_with_gravity(self, text: str, unit: str | Dimension) -> bool:
        """Whether the units are right if g stands for standard gravity where it is written."""
        meant = {name: dimension(with_gravity(own)) for name, own in self.grams.items()}
        expected = dimension(with_gravity(unit)) if isinstance(unit, str) else unit
        try:
            return dimension_of(text, self.dimensions | meant, "") in (None, expected)
        except ModelError:
            return False
