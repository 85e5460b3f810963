"""User expressions, parsed safely into SymPy and checked for units.

The language is Python's arithmetic with the functions of `FUNCTIONS`; `where(condition, a, b)`
selects. No other Python is accepted, so an equation file cannot execute code.
"""

import ast
import difflib
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import sympy

from rigwatch.physics.engine.equations.syntax_tree import is_caret, quoted, syntax_tree
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
        value = sympy.sympify(_Reader(dict(names), where).value(syntax_tree(text, where)))
    except RecursionError:
        raise ModelError(f"{where}: found {quoted(text)}, which is too deep") from None
    except (TypeError, AttributeError):
        # SymPy's answer to arithmetic with a comparison, or to one with infinity.
        raise ModelError(f"{where}: found {quoted(text)}, which cannot be computed") from None
    if value.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo):
        raise ModelError(f"{where}: found {quoted(text)}, which has no finite value")
    if value.has(sympy.I):
        raise ModelError(f"{where}: found {quoted(text)}, which has no real value")
    return value


@lru_cache(maxsize=1024)
def check_size(text: str, where: str) -> None:
    """Check that an expression is not too long or too deeply nested.

    Raises:
        ModelError: it is, or it does not parse.
    """
    syntax_tree(text, where)


def renamed(text: str, names: Mapping[str, str]) -> str:
    """An expression with names replaced by others, or by expressions, all at once."""
    return re.sub(r"\b[A-Za-z_]\w*", lambda name: names.get(name[0], name[0]), text)


@lru_cache(maxsize=4096)
def names_in(text: str, where: str) -> frozenset[str]:
    """All names in the expression `text` except functions.

    Raises:
        ModelError: it does not parse.
    """
    tree = syntax_tree(text, where)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return frozenset(
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in called
    )


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
        hint = ": write ** for a power" if is_caret(node) else ""
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
