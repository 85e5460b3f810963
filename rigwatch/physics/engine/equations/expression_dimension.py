"""Physical dimensions of units and expressions, to refuse equations such as metres plus volts.

A dimension is the tuple of exponents of (kg, m, s, A, K); volts are kg m² s⁻³ A⁻¹, so that kt²/R of
a motor has the unit of a damping. The table of units is that of `rigwatch.wire.units`.
"""

import ast
from collections.abc import Mapping
from fractions import Fraction

from rigwatch.physics.engine.equations.syntax_tree import quoted, syntax_tree
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import NONE, Dimension, UnitError, describe, times, unit_of

_SAME_UNIT = {"max", "min", "abs"}


def dimension(unit: str) -> Dimension:
    """The dimension of a unit such as "N s/m", "m/s^2" or "N/(m/s)".

    Raises:
        ModelError: a part of the unit is unknown.
    """
    try:
        return unit_of(unit).dimension
    except UnitError as error:
        raise ModelError(f"unit: {error}") from None


def dimension_of(text: str, dimensions: Mapping[str, Dimension], where: str) -> Dimension | None:
    """The dimension of the expression `text`; None for zero, which is valid in every unit.

    Raises:
        ModelError: it adds or compares different dimensions, or passes one to a function.
    """
    try:
        return _Measurer(dimensions, where).dim(syntax_tree(text, where))
    except RecursionError:
        raise ModelError(f"{where}: found {quoted(text)}, which is too deep") from None


def has_bare_number(text: str) -> bool:
    """Whether an expression has a number that may lack a unit.

    That is one that is added, compared or a bound, as in max(p, 1000), or has decimals.
    """
    nodes = list(ast.walk(syntax_tree(text, "")))
    alike = [side for node in nodes for side in _of_one_unit(node)]
    numbers = [node for node in nodes if isinstance(node, ast.Constant)]
    return any(
        isinstance(one.value, int | float) and one.value and (one in alike or one.value % 1)
        for one in numbers
    )


def _of_one_unit(node: ast.AST) -> list[ast.expr]:
    """The parts of a node that must have one unit."""
    match node:
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
            return [left, right]
        case ast.Compare(left=left, comparators=others):
            return [left, *others]
        case ast.Call(func=ast.Name(id="where"), args=[_, *chosen]):
            return chosen
        case ast.Call(func=ast.Name(id=name), args=args) if name in _SAME_UNIT:
            return args
    return []


class _Measurer:
    """Walks the syntax tree and computes dimensions."""

    def __init__(self, dimensions: Mapping[str, Dimension], where: str) -> None:
        self._dimensions, self._where = dimensions, where

    def dim(self, node: ast.AST) -> Dimension | None:  # noqa: PLR0911 -- one a kind of node
        match node:
            case ast.Constant(value=number):
                return None if number == 0 else NONE
            case ast.Name(id=name):
                return self._dimensions[name]
            case ast.UnaryOp(operand=operand):
                return self.dim(operand)
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
                return self._same(node, self.dim(left), self.dim(right))
            case ast.BinOp(left=left, op=ast.Mult(), right=right):
                return self._scaled(self.dim(left), self.dim(right), 1)
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return self._scaled(self.dim(left), self.dim(right), -1)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return self._power(node, self.dim(left), right)
            case ast.Compare(left=left, comparators=[right]):
                self._same(node, self.dim(left), self.dim(right))
                return NONE
            case ast.Call(func=ast.Name(id=name), args=args):
                return self._function(node, name, args)
        return NONE

    def _same(
        self, node: ast.AST, one: Dimension | None, other: Dimension | None
    ) -> Dimension | None:
        if one is not None and other is not None and one != other:
            raise ModelError(
                f"{self._where}: found {ast.unparse(node)!r} with units"
                f" {describe(one)} and {describe(other)}, expected one unit"
            )
        return other if one is None else one

    def _scaled(
        self, one: Dimension | None, other: Dimension | None, power: int
    ) -> Dimension | None:
        return None if one is None else times(one, other or NONE, power)

    def _power(self, node: ast.AST, base: Dimension | None, exponent: ast.expr) -> Dimension | None:
        if base is None or base == NONE:
            return base
        try:
            return times(NONE, base, Fraction(str(ast.literal_eval(exponent))))
        except ValueError:
            raise ModelError(
                f"{self._where}: found {ast.unparse(node)!r}, expected a number as exponent of"
                f" a quantity in {describe(base)}"
            ) from None

    def _function(self, node: ast.AST, name: str, args: list[ast.expr]) -> Dimension | None:
        dims = [self.dim(arg) for arg in args]
        if name == "where":
            return self._same(node, dims[1], dims[2])
        if name in _SAME_UNIT:
            return dims[0] if len(dims) == 1 else self._same(node, dims[0], dims[1])
        if name == "sqrt":
            return None if dims[0] is None else times(NONE, dims[0], Fraction(1, 2))
        if name != "sign" and dims[0] not in (None, NONE):
            raise ModelError(
                f"{self._where}: found {ast.unparse(node)!r} of a quantity in"
                f" {describe(dims[0] or NONE)}, expected a pure number"
            )
        return NONE
