"""Python's syntax tree of a user expression, with bounded length and depth."""

import ast
import warnings
from functools import lru_cache

from rigwatch.wire.errors import ModelError

LONGEST = 20_000
"""Largest length of an expression in characters."""
DEEPEST, DEEPEST_CALLS = 400, 24
"""Largest nesting depth of operations and functions, which SymPy processes recursively."""


def syntax_tree(text: str, where: str) -> ast.expr:
    """Python's syntax tree of an expression, after checking its length and depth.

    It is shared by all that read the same text.
    """
    if len(text) > LONGEST:
        found = f"found {len(text)} characters"
        raise ModelError(f"{where}: {found}, expected an expression of at most {LONGEST}")
    try:
        tree, deep = _parsed(text)
    except SyntaxError as error:
        raise ModelError(
            f"{where}: found {quoted(text)}, which breaks off at character {error.offset}"
        ) from None
    except (RecursionError, MemoryError, ValueError):
        raise ModelError(f"{where}: found {quoted(text)}, which cannot be read") from None
    if deep:
        expected = f"operations at most {DEEPEST} deep, functions {DEEPEST_CALLS}"
        raise ModelError(f"{where}: found {quoted(text)}, expected {expected}")
    return tree


@lru_cache(maxsize=1024)
def _parsed(text: str) -> tuple[ast.expr, bool]:
    """The tree, and whether it is nested too deeply; each effect is read at every port."""
    with warnings.catch_warnings():
        # Python's remarks on style, such as "2and x", belong to its programs only.
        warnings.simplefilter("ignore", SyntaxWarning)
        tree = ast.parse(text.strip(), mode="eval").body
    return tree, _is_deep(tree)


def _is_deep(tree: ast.AST) -> bool:
    """Whether operations or functions are nested too deeply."""
    level = [(tree, 0)]
    for _ in range(DEEPEST):
        if any(calls > DEEPEST_CALLS for _, calls in level):
            return True
        if not level:
            return False
        level = [
            (child, calls + isinstance(node, ast.Call))
            for node, calls in level
            for child in ast.iter_child_nodes(node)
        ]
    return bool(level)


def quoted(text: str) -> str:
    """An expression in quotes, shortened if long."""
    return repr(text) if len(text) <= 200 else f"{text[:200]!r}…"


def is_caret(node: ast.AST) -> bool:
    """Whether a node is `a ^ b`, often meant as a power."""
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor)
