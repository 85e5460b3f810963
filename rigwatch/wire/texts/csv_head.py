"""Finds the header of a CSV file below a logger's preamble, and a line of units below the header.

Logger 7;serial 1234
Time;Force
s;kN
0,00;1,25
"""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from rigwatch.wire.texts.headers import read_header
from rigwatch.wire.texts.written_times import time_style
from rigwatch.wire.units import in_table_words, is_unit

DELIMITERS = ";\t,"
"""Delimiters, in the order in which they are tried."""
HEAD = 60
"""Lines within which the data begin."""
MARKS = "#%"
"""What a line of comment begins with."""
_NUMBER = re.compile(r"\s*[+-]?\d*[.,]?\d+([eE][+-]?\d+)?\s*")
_NOTHING = frozenset(("", "-", "[]", "()"))


@dataclass(frozen=True, slots=True)
class Head:
    """Where the data begin.

    Attributes:
        names: of the columns, with their units.
        rows: lines before the data.
        delimiter: between the cells.
    """

    names: tuple[str, ...]
    rows: int
    delimiter: str


def found_head(lines: Sequence[str], delimiter: str) -> Head | None:
    """The head of a file with a preamble or a line of units; None if it is the first line.

    Args:
        lines: the first of the file.
        delimiter: "auto", "whitespace" or a character.
    """
    if len(delimiter) != 1 and delimiter not in ("auto", "whitespace"):
        return None
    tried = (*DELIMITERS, "whitespace") if delimiter == "auto" else (delimiter,)
    for mark in tried:
        rows = [_cells(line, mark) for line in lines]
        first = next((at for at, row in enumerate(rows) if at and _is_data(row)), None)
        if first is None or len(rows[first]) < 2:
            continue
        head = _above(rows, first, mark)
        if head is not None:
            return head if first > 1 else None
    return None


def is_number(cell: str) -> bool:
    """Whether a cell holds a number."""
    return _NUMBER.fullmatch(cell) is not None


def _above(rows: Sequence[list[str]], first: int, mark: str) -> Head | None:
    """The names above the first row of data, with the units between them, if there are some."""
    width = len(rows[first])
    at = first - 1
    units = rows[at] if at and _are_units(rows[at]) and len(rows[at]) == width else None
    names = rows[at - 1] if units else rows[at]
    if len(names) != width or any(map(is_number, names)):
        return None
    if names[0][:1] in tuple(MARKS):
        names = [names[0].lstrip(MARKS).strip(), *names[1:]]
    before = rows[: at - bool(units)]
    # A line like the header that stands above it may be the header, and this one a broken row.
    if not all(names) or any(
        len(row) == width and row[0][:1] not in tuple(MARKS) for row in before
    ):
        return None
    return Head(tuple(_with_units(names, units)), first, mark)


def _with_units(names: Sequence[str], units: Sequence[str] | None) -> list[str]:
    """The names, those without a unit of their own with that of the line below."""
    told = [unit.strip("[]() ") for unit in units or [""] * len(names)]
    return [
        f"{name.strip()} [{unit}]" if unit and unit != "-" and not read_header(name).units else name
        for name, unit in zip(names, told, strict=True)
    ]


def _are_units(row: Sequence[str]) -> bool:
    """Whether a line holds units only, at least one."""
    told = [cell.strip("[]() ") for cell in row if cell not in _NOTHING]
    return bool(told) and all(is_unit(in_table_words(text)) for text in told)


def _is_data(row: Sequence[str]) -> bool:
    """Whether a line holds numbers, and nothing else but times and gaps."""
    numbers = [is_number(cell) for cell in row]
    others = [cell for cell, number in zip(row, numbers, strict=True) if cell and not number]
    return any(numbers) and all(_is_value(cell) for cell in others)


def _is_value(cell: str) -> bool:
    return cell.lower() in ("nan", "inf", "-inf", "none") or time_style([cell]) is not None


def _cells(line: str, mark: str) -> list[str]:
    if mark == "whitespace":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=mark), [])]
    except csv.Error:
        return []
