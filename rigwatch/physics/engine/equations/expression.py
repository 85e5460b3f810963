"""User expressions, parsed safely into SymPy and checked for units.

The language is Python's arithmetic with the functions of `FUNCTIONS`; `where(condition, a, b)`
selects. No other Python is accepted, so an equation file cannot execute code.
"""

import ast
import difflib
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

import sympy

from rigwatch.physics.engine.equations.dimension import NONE, Dimension, describe, times
from rigwatch.wire.errors import ModelError

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": sympy.Abs,
    "atan": sympy.atan,
    "cos": sympy.cos,
    "exp": sympy.exp,
    "floor": sympy.floor,
    "log": sympy.log,
    "max": sympy.Max,
    "min": sympy.Min,
    "sign": sympy.sign,
    "sin": sympy.sin,
    "sqrt": sympy.sqrt,
    "tanh": sympy.tanh,
    "where": lambda condition, a, b: sympy.Piecewise((a, condition), (b, True)),
}
_SAME_UNIT = {"max", "min", "abs"}
_OPERATORS: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}
_COMPARISONS: dict[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Lt: sympy.Lt,
    ast.LtE: sympy.Le,
    ast.Gt: sympy.Gt,
    ast.GtE: sympy.Ge,
}


LONGEST = 20_000
"""Largest length of an expression in characters."""
DEEPEST, DEEPEST_CALLS = 400, 24
"""Largest nesting depth of operations and functions, which SymPy processes recursively."""
LARGEST_EXPONENT = 64.0
"""Largest numeric exponent of a power."""
MOST_BITS = 4096
"""Most digits of an integer evaluated while parsing: 9**9**9 would have 370 million."""


def parse(text: str, names: Mapping[str, sympy.Expr], where: str) -> sympy.Expr:
    """The expression `text` in the symbols `names`.

    Args:
        text: the user's text.
        names: the allowed symbols, by name.
        where: what the expression defines, for errors.

    Raises:
        ModelError: it does not parse, or uses an unknown name.
    """
    return _parsed(text, tuple(names.items()), where)


@lru_cache(maxsize=4096)
def _parsed(text: str, names: tuple[tuple[str, sympy.Expr], ...], where: str) -> sympy.Expr:
    """`parse` with a cache: SymPy takes milliseconds to simplify `where`, `min` and `max`."""
    try:
        value = sympy.sympify(_Reader(dict(names), where).value(_tree(text, where)))
    except RecursionError:
        raise ModelError(f"{where}: found {_shown(text)}, which is too deep") from None
    if value.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo):
        raise ModelError(f"{where}: found {_shown(text)}, which has no finite value")
    return value


def check_size(text: str, where: str) -> None:
    """Check that an expression is not too long or too deeply nested.

    Raises:
        ModelError: it is, or it does not parse.
    """
    _tree(text, where)


def names_in(text: str, where: str) -> frozenset[str]:
    """All names in the expression `text` except functions.

    Raises:
        ModelError: it does not parse.
    """
    tree = _tree(text, where)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return frozenset(
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in called
    )


def _tree(text: str, where: str) -> ast.expr:
    """Python's syntax tree of an expression, after checking its length and depth."""
    if len(text) > LONGEST:
        found = f"found {len(text)} characters"
        raise ModelError(f"{where}: {found}, expected an expression of at most {LONGEST}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        raise ModelError(
            f"{where}: found {_shown(text)}, which breaks off at character {error.offset}"
        ) from None
    except (RecursionError, MemoryError, ValueError):
        raise ModelError(f"{where}: found {_shown(text)}, which cannot be read") from None
    if _is_deep(tree):
        expected = f"operations at most {DEEPEST} deep, functions {DEEPEST_CALLS}"
        raise ModelError(f"{where}: found {_shown(text)}, expected {expected}")
    return tree


def _is_deep(tree: ast.AST) -> bool:
    """Whether operations or functions are nested too deeply."""
    level = [(tree, 0)]
    for _ in range(DEEPEST):
        if any(calls > DEEPEST_CALLS for _, calls in level):
            return True
        level = [
            (child, calls + isinstance(node, ast.Call))
            for node, calls in level
            for child in ast.iter_child_nodes(node)
        ]
    return bool(level)


def _shown(text: str) -> str:
    return repr(text) if len(text) <= 200 else f"{text[:200]!r}…"


class _Reader:
    """Walks Python's syntax tree and builds the SymPy expression."""

    def __init__(self, names: Mapping[str, sympy.Expr], where: str) -> None:
        self._names, self._where = names, where

    def value(self, node: ast.AST) -> Any:
        match node:
            case ast.Constant(value=bool()):
                pass
            case ast.Constant(value=int() | float() as number):
                return sympy.Integer(number) if isinstance(number, int) else sympy.Float(number)
            case ast.Name(id=name):
                return self._named(name, self._names, "name")
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -self.value(operand)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
                return self._combined(op, self.value(left), self.value(right))
            case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARISONS:
                return _COMPARISONS[type(op)](self.value(left), self.value(right))
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
                function = self._named(name, FUNCTIONS, "function")
                return self._called(name, function, [self.value(arg) for arg in args])
        hint = ": write ** for a power" if _is_caret(node) else ""
        raise ModelError(
            f"{self._where}: found {ast.unparse(node)!r}, which is no arithmetic{hint}"
        )

    def _combined(self, op: ast.operator, left: Any, right: Any) -> Any:
        if isinstance(op, ast.Pow) and (excess := _excess(sympy.sympify(left), right)):
            raise ModelError(f"{self._where}: found {excess}, expected a smaller power")
        return _OPERATORS[type(op)](left, right)

    def _named(self, name: str, known: Mapping[str, Any], kind: str) -> Any:
        if name in known:
            return known[name]
        close = difflib.get_close_matches(name, known, 1)
        expected = f"{close[0]!r}" if close else f"one of {', '.join(sorted(known))}"
        raise ModelError(f"{self._where}: found the unknown {kind} {name!r}, expected {expected}")

    def _called(self, name: str, function: Callable[..., Any], args: list[Any]) -> Any:
        try:
            return function(*args)
        except TypeError:
            raise ModelError(f"{self._where}: found {len(args)} arguments of {name}()") from None


def _excess(base: sympy.Expr, exponent: Any) -> str:
    """Why a power is too large for SymPy to evaluate; empty if it is not."""
    if not isinstance(exponent, sympy.Rational | sympy.Float):
        return ""
    if abs(exponent) > LARGEST_EXPONENT:
        return f"an exponent beyond {LARGEST_EXPONENT:g}"
    digits = max(base.p.bit_length(), base.q.bit_length()) if base.is_Rational else 0
    return "a number of too many digits" if digits * abs(exponent) > MOST_BITS else ""


def dimension_of(text: str, dimensions: Mapping[str, Dimension], where: str) -> Dimension | None:
    """The dimension of the expression `text`; None for zero, which is valid in every unit.

    Raises:
        ModelError: it adds or compares different dimensions, or passes one to a function.
    """
    try:
        return _Measurer(dimensions, where).dim(_tree(text, where))
    except RecursionError:
        raise ModelError(f"{where}: found {_shown(text)}, which is too deep") from None


def _is_caret(node: ast.AST) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor)


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

    def _power(self, node: ast.AST, base: Dimension | None, exponent: ast.AST) -> Dimension | None:
        if base is None or base == NONE:
            return base
        try:
            return times(NONE, base, Fraction(str(ast.literal_eval(ast.unparse(exponent)))))
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
