"""Foreign files as tables of named columns, whose errors name file, line and column."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.texts import TimeStyle, past_midnight, time_style

Cells = Sequence[str] | np.ndarray[Any, Any]
"""A column as it was read, text or numbers."""
A = TypeVar("A", FloatArray, IntArray)


@dataclass
class Table:
    """Columns of equal length.

    Attributes:
        path: the file, named in errors.
        cells: the columns as they were read, text or numbers.
        scalars: single numbers of the file, by name.
        first_line: line of row 0 in a CSV file, otherwise None.
    """

    path: Path
    cells: dict[str, Cells]
    scalars: dict[str, float] = field(default_factory=dict)
    first_line: int | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.cells)

    def place(self, row: int, column: str) -> str:
        """Location of a cell, for errors."""
        if self.first_line is None:
            return f"{self.path}, row {row + 1}, column {column}"
        return f"{self.path}:{self.first_line + row}, column {column}"

    def states_time(self, column: str) -> bool:
        """Whether a column has dates or durations, which are numbers in seconds."""
        cells = self.cells[column]
        dated = isinstance(cells, np.ndarray) and cells.dtype.kind in "mM"
        return dated or self._time_style(column) is not None

    def parts(self) -> Iterator["Table"]:
        """The rows in parts that fit into memory: here all of them, which are there already."""
        yield self

    def numbers(self, column: str, allow_missing: bool = False) -> FloatArray:
        """A column as numbers; dates since 1970, durations and times of day in seconds.

        Args:
            column: its name.
            allow_missing: empty cells and NaN are NaN, not an error.

        Raises:
            ImportDataError: a cell is no number; its place is named.
        """
        style = self._time_style(column)
        if style is not None:
            found = _joined([part._times(column, style) for part in self.parts()])
            return past_midnight(found) if style.form == "clock" else found
        return _joined([part._numbers(column, allow_missing) for part in self.parts()])

    def _time_style(self, column: str) -> TimeStyle | None:
        """How the column states dates or times of day as text; None if it does not."""
        cells = self.cells[column]
        if isinstance(cells, np.ndarray) and cells.dtype.kind not in "OSU":
            return None
        return time_style(str(cell) for cell in cells)

    def _times(self, column: str, style: TimeStyle) -> FloatArray:
        found = np.empty(len(self.cells[column]))
        for row, cell in enumerate(self.cells[column]):
            try:
                found[row] = style.seconds(str(cell))
            except ValueError:
                raise ImportDataError(
                    f"{self.place(row, column)}: found {str(cell)!r}, expected a time written as"
                    " in the first row"
                ) from None
        return found

    def _numbers(self, column: str, allow_missing: bool) -> FloatArray:
        cells = self.cells[column]
        try:
            values = _in_seconds(np.asarray(cells)).astype(np.float64)
        except (ValueError, TypeError, OverflowError):
            values = self._numbers_one_by_one(column, cells, allow_missing)
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad) and not allow_missing:
            row = int(bad[0])
            raise ImportDataError(
                f"{self.place(row, column)}: found {str(cells[row])!r}, expected a finite number"
            )
        return values

    def _numbers_one_by_one(self, column: str, cells: Cells, allow_missing: bool) -> FloatArray:
        values = np.empty(len(cells))
        for row, cell in enumerate(cells):
            text = str(cell).strip()
            try:
                values[row] = np.nan if allow_missing and text in ("", "None") else float(text)
            except ValueError:
                where = self.place(row, column)
                raise ImportDataError(f"{where}: found {text!r}, expected a number") from None
        return values

    def integers(self, column: str) -> IntArray:
        """A column as whole numbers, exact to 63 bits.

        Raises:
            ImportDataError: a cell is no whole number; its place is named.
        """
        return _joined([part._integers(column) for part in self.parts()])

    def _integers(self, column: str) -> IntArray:
        cells = self.cells[column]
        if isinstance(cells, np.ndarray) and cells.dtype.kind in "iu":
            return cells.astype(np.int64)
        values = np.empty(len(cells), np.int64)
        for row, cell in enumerate(cells):
            try:
                values[row] = int(cell)
            except (ValueError, OverflowError, TypeError):
                where = self.place(row, column)
                found = f"found {str(cell)!r}, expected a whole number"
                raise ImportDataError(f"{where}: {found}") from None
        return values

    def without_first(self, rows: int) -> "Table":
        """The table without its first `rows` rows."""
        cells = {name: column[rows:] for name, column in self.cells.items()}
        line = None if self.first_line is None else self.first_line + rows
        return Table(self.path, cells, self.scalars, line)


def _joined(parts: list[A]) -> A:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _in_seconds(cells: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Dates and durations in seconds by their own resolution; other cells as they are."""
    if cells.dtype.kind == "M":
        cells = cells - np.datetime64(0, "s")
    if cells.dtype.kind == "m":
        return np.asarray(cells / np.timedelta64(1, "s"))
    return cells
