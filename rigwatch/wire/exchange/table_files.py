"""Reads CSV, MAT, JSON and Parquet files as tables of named columns."""

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.wire.errors import ImportDataError, MissingExtraError, reason_of
from rigwatch.wire.exchange.budget import Budget
from rigwatch.wire.exchange.json_table import read_json
from rigwatch.wire.exchange.mapping import ImportMapping
from rigwatch.wire.exchange.mat5 import MatError, Value, read_mat5
from rigwatch.wire.exchange.tables import Table

FORMATS = {".csv": "csv", ".txt": "csv", ".tsv": "csv", ".dat": "csv"} | {
    ".mat": "mat",
    ".parquet": "parquet",
    ".json": "json",
}
_DELIMITERS = ";\t,"
"""Delimiters, in the order in which they are tried."""
_DECIMAL_COMMA = re.compile(r"^\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*$")


def read_table(path: Path, mapping: ImportMapping) -> Table:
    """The table in the file at `path`, without the rows that the mapping leaves out.

    Raises:
        ImportDataError: the file cannot be read, is of no known format, or holds no rows.
        MissingExtraError: it is Parquet and pyarrow is not installed.
    """
    kind = mapping.format if mapping.format != "auto" else FORMATS.get(path.suffix.lower(), "")
    if kind not in _READERS:
        known = ", ".join(FORMATS)
        raise ImportDataError(f"{path}: unknown format {path.suffix!r}, expected one of {known}")
    try:
        table = _READERS[kind](path, mapping)
    except OSError as error:
        reason = reason_of(error)
        raise ImportDataError(f"{path}: cannot be read: {reason}") from error
    table = table.without_first(mapping.skip_rows)
    if not table.cells or not max(len(column) for column in table.cells.values()):
        raise ImportDataError(f"{path}: found no rows of data, expected at least one")
    return table


def columns_of(path: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """Cells of each column of a foreign file, and its single numbers.

    Raises:
        ImportDataError: it cannot be read.
    """
    table = read_table(path, ImportMapping())
    return dict(table.cells), table.scalars


def _read_csv(path: Path, mapping: ImportMapping) -> Table:
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ImportDataError(f"{path}: found bytes that are not UTF-8, expected text") from error
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise ImportDataError(f"{path}: the file is empty, expected rows of data")
    try:
        rows = _rows(lines, mapping.delimiter)
    except ImportDataError as error:
        raise ImportDataError(f"{path}: {error}") from None
    if not mapping.columns and _all_numbers(rows[0]):
        raise ImportDataError(
            f"{path}:1: found numbers, expected names of columns; name the {len(rows[0])} columns"
            " with --columns A,B,…"
        )
    header = [name.strip() for name in (mapping.columns or rows.pop(0))]
    first_line = 1 if mapping.columns else 2
    if len(set(header)) < len(header):
        raise ImportDataError(f"{path}:1: found the columns {header}, expected different names")
    for number, row in enumerate(rows):
        if len(row) != len(header):
            where = f"{path}:{number + first_line}"
            raise ImportDataError(f"{where}: found {len(row)} cells, expected {len(header)}")
    rows = _with_points(rows)
    columns = zip(*rows, strict=True) if rows else [()] * len(header)
    return Table(path, dict(zip(header, columns, strict=True)), first_line=first_line)


def _all_numbers(cells: list[str]) -> bool:
    return all(re.fullmatch(r"\s*[+-]?\d*[.,]?\d+([eE][+-]?\d+)?\s*", cell) for cell in cells)


def _with_points(rows: list[list[str]]) -> list[list[str]]:
    """Rows with decimal commas replaced by decimal points."""
    return [[_pointed(cell) for cell in row] if any("," in c for c in row) else row for row in rows]


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if "," in cell and _DECIMAL_COMMA.match(cell) else cell


def _rows(lines: list[str], delimiter: str) -> list[list[str]]:
    if delimiter == "auto":
        # With semicolons or tabs as delimiters, commas are decimal commas.
        delimiter = next((mark for mark in _DELIMITERS if mark in lines[0]), "whitespace")
    if delimiter == "whitespace":
        return [line.split() for line in lines]
    if len(delimiter) != 1:
        expected = "auto, whitespace or one character"
        raise ImportDataError(f"delimiter: found {delimiter!r}, expected {expected}")
    try:
        return list(csv.reader(lines, delimiter=delimiter))
    except csv.Error as error:
        raise ImportDataError(f"not readable as CSV: {error}") from None


def _read_mat(path: Path, _: ImportMapping) -> Table:
    try:
        variables = read_mat5(path.read_bytes())
    except MatError as error:
        raise ImportDataError(f"{path}: found {error}") from error
    arrays = {name: item for name, item in variables.items() if isinstance(item, np.ndarray)}
    titles = _titles(variables.get("column_titles"), arrays)
    table = Table(path, {titles[name]: arrays[name].ravel() for name in titles})
    for name, value in arrays.items():
        if name in titles:
            continue
        if value.size == 1:
            table.scalars[name] = float(value.item())
        elif value.ndim == 2 and min(value.shape) == 1:
            table.cells[name] = value.ravel()
    if not table.cells:
        raise ImportDataError(
            f"{path}: found {_shapes(arrays)}, expected a variable for each column, such as t, u"
            " and y; structures are not read"
        )
    return table


def _shapes(arrays: dict[str, Any]) -> str:
    """Variables that are no columns, with their shapes."""
    shapes = (f"{name} of {' x '.join(map(str, value.shape))}" for name, value in arrays.items())
    return ", ".join(shapes) or "no array of numbers"


def _titles(found: Value | None, arrays: dict[str, Any]) -> dict[str, str]:
    """Column titles by variable, added by `rigwatch export`: names in MAT files have no units."""
    pairs = [text.partition("=") for text in found] if isinstance(found, list) else []
    return {name: title for name, _, title in pairs if name in arrays}


def _read_json(path: Path, _: ImportMapping) -> Table:
    return read_json(path)


def _read_parquet(path: Path, _: ImportMapping) -> Table:
    try:
        from pyarrow import parquet
    except ImportError:
        raise MissingExtraError("pyarrow", "parquet", "reading Parquet files") from None
    import pyarrow

    try:
        rows, columns = parquet.read_metadata(path).num_rows, parquet.read_schema(path).names
        Budget(path.stat().st_size).take(8 * rows * len(columns))
        found = parquet.read_table(path)
    except (pyarrow.ArrowException, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise ImportDataError(f"{path}: not a readable Parquet file: {reason}") from error
    return Table(
        path, {name: found[name].to_numpy(zero_copy_only=False) for name in found.column_names}
    )


_READERS: dict[str, Callable[[Path, ImportMapping], Table]] = {
    "csv": _read_csv,
    "mat": _read_mat,
    "parquet": _read_parquet,
    "json": _read_json,
}
