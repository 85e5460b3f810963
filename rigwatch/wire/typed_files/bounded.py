"""Reads TOML from untrusted sources: its cost is bounded before it is parsed.

A few kilobytes can be expensive: an integer of thousands of digits, deeply nested tables, a key of
ten thousand parts. Valid files are far below these bounds.
"""

import re
import tomllib
from typing import Any

LARGEST_TEXT = 1 << 22
"""Largest length of a TOML text [characters]."""
DEEPEST = 32
"""Largest nesting depth of tables and arrays, and number of parts of a dotted key."""
LONGEST_NUMBER = 128
"""Largest length of a number [characters]."""

_OPAQUE = re.compile(
    r'"""(?:[^\\]|\\.)*?"""|\'\'\'.*?\'\'\'|"(?:[^"\\\n]|\\.)*+"|\'[^\'\n]*+\'|\#[^\n]*+', re.DOTALL
)
_BRACKET = re.compile(r"[\[\]{}]")
_CHAIN = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST},}}")
_NUMBER = re.compile(rf"(?<![\w.-])\d[\w.]{{{LONGEST_NUMBER},}}+(?![\w.-]*+[ \t]*+=)")


def loads(text: str) -> dict[str, Any]:
    """The TOML `text` as a mapping.

    Raises:
        TOMLDecodeError: it is not TOML, or exceeds a bound.
    """
    if problem := _excess(text):
        raise tomllib.TOMLDecodeError(problem)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except (ValueError, RecursionError, OverflowError) as error:
        raise tomllib.TOMLDecodeError(f"a value that cannot be read: {error}") from None


def _excess(text: str) -> str:
    """The bound that is exceeded, in words; "" if none is."""
    if len(text) > LARGEST_TEXT:
        return f"{len(text)} characters, more than {LARGEST_TEXT}"
    # Strings and comments may contain anything and are replaced by a name.
    plain = _OPAQUE.sub(lambda match: "" if match[0][0] == "#" else "s", text)
    if _depth(plain) > DEEPEST:
        return f"tables or arrays more than {DEEPEST} deep"
    if _CHAIN.search(plain):
        return f"a key of more than {DEEPEST} parts"
    if found := _NUMBER.search(plain):
        return f"a number of {len(found[0])} characters"
    return ""


def _depth(plain: str) -> int:
    """Nesting depth of the brackets."""
    depth = deepest = 0
    for match in _BRACKET.finditer(plain):
        depth += 1 if match[0] in "[{" else -1
        deepest = max(deepest, depth)
    return deepest
