"""CSV files as tables that are read in parts, so that memory does not grow with the file."""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, overload

import numpy as np

from rigwatch.wire.errors import ImportDataError, reason_of
from rigwatch.wire.exchange.mapping import ImportMapping
from rigwatch.wire.exchange.tables import Cells, Table
from rigwatch.wire.texts import DELIMITERS, HEAD, encoding_of, found_head, is_number

PART = 4096
"""Rows in memory at a time; a whole block of a session."""
_DECIMAL_COMMA = re.compile(r"^\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*$")
Rows = list[list[str]]


def read_csv(path: Path, mapping: ImportMapping) -> Table:
    """The table of a CSV file, all of whose rows are looked at but not kept.

    Raises:
        ImportDataError: it is no text, has no header, or a row has another number of cells.
    """
    encoding = _encoding(path)
    source = _Source(path, encoding, None if path.is_file() else list(_text_lines(path, encoding)))
    lines = list(islice(source.lines(), HEAD))
    if not lines:
        raise ImportDataError(f"{path}: the file is empty, expected rows of data")
    found = None if mapping.columns else found_head(lines, mapping.delimiter)
    delimiter = found.delimiter if found else _delimiter(path, mapping.delimiter, lines[0])
    names = list(found.names) if found else next(_split(path, iter(lines), delimiter))
    if mapping.columns:
        names = list(mapping.columns)
    elif _all_numbers(names):
        raise ImportDataError(
            f"{path}:1: found numbers, expected names of columns; name the {len(names)} columns"
            " with --columns A,B,…"
        )
    header = tuple(name.strip() for name in names)
    if len(set(header)) < len(header):
        raise ImportDataError(
            f"{path}:1: found the columns {list(header)}, expected different names"
        )
    start = found.rows if found else 0 if mapping.columns else 1
    count = sum(1 for _ in _Content(source, delimiter, header, start).rows())
    return CsvTable.of(_Content(source, delimiter, header, start, count))


@dataclass(frozen=True)
class _Source:
    """The file's lines; those of a pipe, which is read once, are held."""

    path: Path
    encoding: str
    held: list[str] | None = None

    def lines(self) -> Iterator[str]:
        """All lines up to the last that is not blank."""
        blank: list[str] = []
        for line in _text_lines(self.path, self.encoding) if self.held is None else self.held:
            blank.append(line)
            if line.strip():
                yield from blank
                blank.clear()


@dataclass(frozen=True)
class _Content:
    """The rows of data: `first` rows of the file are left out, `count` are there."""

    source: _Source
    delimiter: str
    header: tuple[str, ...]
    first: int
    count: int | None = None

    def rows(self) -> Iterator[list[str]]:
        """Each row, with as many cells as the header and decimal points."""
        path, width = self.source.path, len(self.header)
        found = _split(path, self.source.lines(), self.delimiter)
        for number, row in enumerate(islice(found, self.first, None), start=self.first + 1):
            if len(row) != width:
                raise ImportDataError(f"{path}:{number}: found {len(row)} cells, expected {width}")
            yield [_pointed(cell) for cell in row] if any("," in cell for cell in row) else row

    def parts(self) -> Iterator[Rows]:
        """The rows that were counted, in parts.

        Raises:
            ImportDataError: the file has fewer by now.
        """
        left, rows = self.count or 0, self.rows()
        while left:
            part = list(islice(rows, min(PART, left)))
            if not part:
                raise ImportDataError(f"{self.source.path}: the file changed while it was read")
            left -= len(part)
            yield part


@dataclass(frozen=True)
class _Column(Sequence[str]):
    """A column that is read when it is asked for."""

    content: _Content
    at: int

    def __len__(self) -> int:
        return self.content.count or 0

    def __iter__(self) -> Iterator[str]:
        return (row[self.at] for part in self.content.parts() for row in part)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> list[str]: ...
    def __getitem__(self, index: int | slice) -> str | list[str]:
        asked = range(len(self))[index]
        if isinstance(asked, int):
            return next(islice(self, asked, None))
        return list(islice(self, asked.start, asked.stop, asked.step))

    def __array__(self, *_: Any, **__: Any) -> np.ndarray[Any, Any]:
        return np.array(list(self))


@dataclass
class CsvTable(Table):
    """A table whose cells stay in the file."""

    content: _Content | None = None

    @classmethod
    def of(cls, content: _Content) -> "CsvTable":
        """The table of the rows of a file."""
        columns = (_Column(content, at) for at in range(len(content.header)))
        cells: dict[str, Cells] = dict(zip(content.header, columns, strict=True))
        return cls(content.source.path, cells, {}, content.first + 1, content)

    def parts(self) -> Iterator[Table]:
        """The table in parts of up to `PART` rows, each in memory."""
        assert self.content is not None
        assert self.first_line is not None
        line = self.first_line
        for rows in self.content.parts():
            columns = zip(*rows, strict=True)
            yield Table(self.path, dict(zip(self.names, columns, strict=True)), first_line=line)
            line += len(rows)

    def without_first(self, rows: int) -> Table:
        """The table without its first `rows` rows."""
        assert self.content is not None
        old = self.content
        count = max(0, (old.count or 0) - rows)
        return CsvTable.of(_Content(old.source, old.delimiter, old.header, old.first + rows, count))


def _encoding(path: Path) -> str:
    try:
        return encoding_of(path)
    except OSError as error:
        raise ImportDataError(f"{path}: cannot be read: {reason_of(error)}") from error


def _text_lines(path: Path, encoding: str) -> Iterator[str]:
    """Lines as `str.splitlines` has them."""
    try:
        with path.open(encoding=encoding) as file:
            for line in file:
                yield from line.splitlines()
    except UnicodeDecodeError as error:
        raise ImportDataError(f"{path}: found bytes that are no text, expected text") from error
    except OSError as error:
        raise ImportDataError(f"{path}: cannot be read: {reason_of(error)}") from error


def _delimiter(path: Path, delimiter: str, first: str) -> str:
    if delimiter == "auto":
        # With semicolons or tabs as delimiters, commas are decimal commas.
        return next((mark for mark in DELIMITERS if mark in first), "whitespace")
    if delimiter != "whitespace" and len(delimiter) != 1:
        expected = "auto, whitespace or one character"
        raise ImportDataError(f"{path}: delimiter: found {delimiter!r}, expected {expected}")
    return delimiter


def _split(path: Path, lines: Iterator[str], delimiter: str) -> Iterator[list[str]]:
    if delimiter == "whitespace":
        yield from (line.split() for line in lines)
        return
    try:
        yield from csv.reader(lines, delimiter=delimiter)
    except csv.Error as error:
        raise ImportDataError(f"{path}: not readable as CSV: {error}") from None


def _all_numbers(cells: list[str]) -> bool:
    return all(map(is_number, cells))


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if "," in cell and _DECIMAL_COMMA.match(cell) else cell
