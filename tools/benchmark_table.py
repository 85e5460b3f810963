"""One row of the table that `make bench` prints, and the table."""

import textwrap
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass

HEADINGS = ("", "what", "measured", "bar", "published")
WIDEST = (4, 44, 34, 26, 26)
"""Widest that a column gets in text [characters]; longer cells are wrapped."""
ALWAYS = 3
"""Columns that a page always shows: verdict, what and measured."""
RUNS = "runs"
"""Bar of a benchmark that ended with an error."""


@dataclass(frozen=True, slots=True)
class Row:
    """One result.

    Attributes:
        what: what was measured.
        measured: the result, with unit.
        bar: what it has to reach, empty where there is no bar.
        published: the published figure it can be held against, empty where there is none.
        note: conditions that one needs to know to judge it.
        passed: whether it reaches the bar, None where there is none.
    """

    what: str
    measured: str
    bar: str
    published: str
    note: str
    passed: bool | None

    @property
    def verdict(self) -> str:
        """ok, MISS, or nothing where there is no bar."""
        return {True: "ok", False: "MISS", None: ""}[self.passed]


def rows_of(name: str, run: Callable[[], list[Row]]) -> list[Row]:
    """The rows of a benchmark; one that fails is a row that misses its bar."""
    try:
        return run()
    except Exception as error:
        traceback.print_exc()
        return [failed(name, error)]


def failed(name: str, error: Exception) -> Row:
    """The row of a benchmark that ended with `error`."""
    return Row(name, f"failed: {type(error).__name__}", RUNS, "", str(error), passed=False)


def ran(rows: Sequence[Row]) -> bool:
    """Whether a benchmark came to its end and measured something."""
    return bool(rows) and all(row.bar != RUNS for row in rows)


def as_text(rows: Sequence[Row]) -> str:
    """The table for a terminal, notes below their rows."""
    wrapped = [[_wrap(cell, w) for cell, w in zip(_cells(r), WIDEST, strict=True)] for r in rows]
    widths = [
        max([len(heading)] + [len(line) for row in wrapped for line in row[column]])
        for column, heading in enumerate(HEADINGS)
    ]
    out = [_line(HEADINGS, widths), _line(["-" * width for width in widths], widths)]
    for row, cells in zip(rows, wrapped, strict=True):
        height = max(len(cell) for cell in cells)
        padded = [cell + [""] * (height - len(cell)) for cell in cells]
        out += [_line(line, widths) for line in zip(*padded, strict=True)]
        out += textwrap.wrap(row.note, 100, initial_indent="      ", subsequent_indent="      ")
    return "\n".join(line.rstrip() for line in out)


def as_markdown(rows: Sequence[Row]) -> str:
    """The table for a page of the documentation, without columns that no row fills."""
    headings, cells = (*HEADINGS, "note"), [(*_cells(row), row.note) for row in rows]
    used = [i for i, _ in enumerate(headings) if i < ALWAYS or any(line[i] for line in cells)]
    lines = [headings, ("---",) * len(headings), *cells]
    return "\n".join(_markdown_line([line[i] for i in used]) for line in lines)


def _markdown_line(cells: Sequence[str]) -> str:
    plain = (cell.strip().replace("|", "\\|").replace("\n", " ") for cell in cells)
    return f"| {' | '.join(plain)} |"


def _cells(row: Row) -> tuple[str, ...]:
    return (row.verdict, row.what, row.measured, row.bar, row.published)


def _wrap(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width) or [""]


def _line(cells: Sequence[str], widths: Sequence[int]) -> str:
    return "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
