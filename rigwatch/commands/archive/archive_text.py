"""Answers of an archive as text."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

WIDEST = 60
"""Widest column [characters]."""


def table(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[str]:
    """Lines of a table, columns aligned."""
    cells = [list(columns), *([cell(value) for value in row] for row in rows)]
    widths = [max(len(line[at]) for line in cells) for at in range(len(columns))]
    return ["  ".join(map(str.ljust, line, widths)).rstrip() for line in cells]


def cell(value: Any) -> str:
    """One value, in at most `WIDEST` characters."""
    if value is None:
        return "–"
    if isinstance(value, datetime):
        text = value.strftime("%Y-%m-%dT%H:%M:%S")
    elif isinstance(value, float):
        text = f"{value:.6g}"
    elif isinstance(value, list):
        text = ", ".join(map(cell, value)) or "–"
    else:
        text = " ".join(str(value).split())
    return text if len(text) <= WIDEST else f"{text[: WIDEST - 1]}…"
