"""Finds the place in a user's file that an error is about: line, column and key."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rigwatch.wire.errors import ConfigError, RigwatchError

_COLUMN = re.compile(r" at column (\d+)\)")
"""Where a line is no TOML."""
_OWNER = re.compile(r"\b(effect|state|output|port|quantity|parameter|input) (\w+)\b")
_KEY = re.compile(r"\b((?:effects|inputs|states|outputs|ports|quantities|parameters)\.[\w.]+)")
_FOUND = re.compile(r"found (?:the unknown name )?'((?:[^'\\]|\\.)+)'")
_BROKEN = re.compile(r"breaks off at character (\d+)")
_HEADER = re.compile(r"\s*\[+\s*([^\]]+?)\s*\]")
_TABLES = {"quantity": "quantities"}


@dataclass(frozen=True)
class Problem:
    """A remark about a place in a file.

    Attributes:
        line, column: of the place, from 1; line 0 stands for the whole file, column 0 for the line.
        length: number of characters that it is about; 0 if unknown.
        text: what is wrong.
        severe: whether the file cannot be used as it is.
    """

    line: int
    column: int
    length: int
    text: str
    severe: bool = True


def problem(error: RigwatchError, text: str, name: str) -> Problem:
    """The problem that an error about a file describes.

    Args:
        error: raised while the file was read or checked.
        text: of the file.
        name: of the file; left out of the problem's text.
    """
    told = str(error).removeprefix(f"{name}: ")
    if isinstance(error, ConfigError) and error.line:
        found = f"found {error.found}, expected {error.expected}"
        if not error.key:
            return _at_column(error.line, found)
        return _at_key(text, error.line, error.key.rpartition(".")[2], f"{error.key}: {found}")
    lines = list(_section(text, _owner(told)))
    return _snippet(lines, told) or Problem(lines[0][0] if lines else 0, 0, 0, told)


def remark(text: str, key: str, told: str, *, severe: bool) -> Problem:
    """A remark about a table, such as "parameters.M"."""
    lines = list(_section(text, key))
    return Problem(lines[0][0] if lines else 0, 0, 0, f"{key}: {told}", severe)


def _at_column(line: int, told: str) -> Problem:
    column = _COLUMN.search(told)
    return Problem(line, int(column[1]), 1, told) if column else Problem(line, 0, 0, told)


def _at_key(text: str, line: int, key: str, told: str) -> Problem:
    words = text.splitlines()[line - 1]
    at = words.find(key)
    return Problem(line, at + 1, len(key), told) if at >= 0 else Problem(line, 0, 0, told)


def _owner(told: str) -> str:
    """The table that an error names, such as "outputs.force"; empty if it names none."""
    if found := _KEY.search(told):
        return found[1].strip(".")
    if found := _OWNER.search(told):
        return f"{_TABLES.get(found[1], f'{found[1]}s')}.{found[2]}"
    return ""


def _section(text: str, table: str) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines of a table with its sub-tables; all lines without a name.

    A table may also be written as a key of its parent: `M = { value = 1 }` in `[parameters]`.
    """
    as_key = re.compile(rf"\s*{re.escape(table.rpartition('.')[2])}\s*[.=]")
    inside = not table
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            inside = f"{header[1]}.".startswith(f"{table}." if table else "")
        if inside or as_key.match(line):
            yield number, line


def _snippet(lines: list[tuple[int, str]], told: str) -> Problem | None:
    """The place of the expression or name that an error quotes."""
    found = _FOUND.search(told)
    if not found:
        return None
    words = found[1].encode().decode("unicode_escape")
    name = words.isidentifier()
    pattern = re.compile(rf"(?<![\w]){re.escape(words)}(?![\w])" if name else re.escape(words))
    for number, line in lines:
        start = line.find("=") + 1
        if match := pattern.search(line, start):
            broken = _BROKEN.search(told)
            if not broken:
                return Problem(number, match.start() + 1, len(words), told)
            after = int(broken[1]) or len(words)
            return Problem(number, match.start() + after, 1, told)
    return None
