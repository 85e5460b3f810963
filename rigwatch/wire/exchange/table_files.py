"""Reads CSV, MAT, JSON and Parquet files as tables of named columns."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.wire.errors import ImportDataError, MissingExtraError, reason_of
from rigwatch.wire.exchange.budget import Budget
from rigwatch.wire.exchange.csv_table import read_csv
from rigwatch.wire.exchange.json_table import read_json
from rigwatch.wire.exchange.mapping import ImportMapping
from rigwatch.wire.exchange.mat5 import MatError, Value, read_mat5
from rigwatch.wire.exchange.tables import Table

FORMATS = {".csv": "csv", ".txt": "csv", ".tsv": "csv", ".dat": "csv"} | {
    ".mat": "mat",
    ".parquet": "parquet",
    ".json": "json",
}
MOST_COLUMNS = 4096
"""Columns of a Parquet file: their descriptions alone take memory."""


def read_table(path: Path, mapping: ImportMapping) -> Table:
    """The table in the file at `path`, without the rows that the mapping leaves out.

    Raises:
        ImportDataError: the file cannot be read, is of no known format, or holds no rows.
        MissingExtraError: it is Parquet and pyarrow is not installed.
    """
    kind = mapping.format if mapping.format != "auto" else FORMATS.get(path.suffix.lower(), "")
    if path.is_dir():
        raise ImportDataError(f"{path}: found a folder, expected a file such as {path / '*.csv'}")
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


def _read_parquet(path: Path, _: ImportMapping) -> Table:
    try:
        from pyarrow import parquet
    except ImportError:
        raise MissingExtraError("pyarrow", "parquet", "reading Parquet files") from None
    import pyarrow

    try:
        found = parquet.read_metadata(path)
        Budget(path.stat().st_size).take(_unpacked_bytes(found))
        flat = _flat(found)
        # As dictionaries: a text that is stored once for many rows stays one in memory too.
        with parquet.ParquetFile(path, read_dictionary=flat) as file:
            read = file.read(columns=flat)
    except (pyarrow.ArrowException, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise ImportDataError(f"{path}: not a readable Parquet file: {reason}") from error
    return Table(
        path, {name: read[name].to_numpy(zero_copy_only=False) for name in read.column_names}
    )


def _unpacked_bytes(found: Any) -> int:
    """Memory that a Parquet file asks for: its columns unpacked, or the arrays made of them."""
    if found.num_columns > MOST_COLUMNS:
        raise ValueError(f"{found.num_columns} columns, expected at most {MOST_COLUMNS}")
    unpacked = sum(int(found.row_group(n).total_byte_size) for n in range(found.num_row_groups))
    return max(unpacked, 8 * int(found.num_rows) * int(found.num_columns), _in_arrays(found))


def _in_arrays(found: Any) -> int:
    """Memory of the values of all columns: lists have several a row, wide ones many bytes each."""
    widths = [max(8, int(found.schema.column(n).length)) for n in range(found.num_columns)]
    groups = map(found.row_group, range(found.num_row_groups))
    return sum(
        width * int(group.column(n).num_values)
        for group in groups
        for n, width in enumerate(widths)
    )


def _flat(found: Any) -> list[str]:
    """Names of the columns with one value a row.

    Lists and structures are no columns of a log, and repeat a text once for each of them.
    """
    paths = [found.schema.column(n).path for n in range(found.num_columns)]
    arrow = found.schema.to_arrow_schema()
    flat = [field.name for field in arrow if not field.type.num_fields]
    within = tuple(f"{name}." for name in flat)
    # Such names select each other.
    if len({*paths}) < len(paths) or any(p.startswith(within) for p in {*paths} - {*flat}):
        raise ValueError("several columns of one name, expected one of each")
    return flat


_READERS: dict[str, Callable[[Path, ImportMapping], Table]] = {
    "csv": read_csv,
    "mat": _read_mat,
    "parquet": _read_parquet,
    "json": lambda path, _: read_json(path),
}
