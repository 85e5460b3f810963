"""Reads a table from JSON: columns by name or a list of rows, at the top or below a header.

{"t": [0, 1], "x": [0.1, 0.2], "gain": 2}            columns, and a single number
[{"t": 0, "x": 0.1}, {"t": 1, "x": 0.2}]             rows
{"mass": 0.5, "rig": {"kp": 8}, "entries": [{…}]}    a header with the numbers mass and rig.kp
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.exchange.tables import Cells, Table
from rigwatch.wire.typed_files import JsonError, json_value


def read_json(path: Path) -> Table:
    """The table of a JSON file with the single numbers beside it.

    Raises:
        ImportDataError: it is not JSON, or holds no table or more than one.
    """
    try:
        found = json_value(path.read_bytes(), object)
    except JsonError as error:
        raise ImportDataError(f"{path}: not readable as JSON: {error}") from error
    header: Mapping[str, Any] = found if isinstance(found, dict) else {}
    columns = _columns(found) or _columns_below(path, header)
    if not columns and found != []:
        expected = "expected columns by name or a list of rows"
        raise ImportDataError(f"{path}: found no table, {expected}")
    cells: dict[str, Cells] = {name: _cells(values) for name, values in columns.items()}
    return Table(path, cells, dict(_numbers(header)))


def _columns(found: object) -> dict[str, Sequence[Any]]:
    """Columns of a list of rows or of an object of columns, otherwise none."""
    if isinstance(found, dict):
        return {name: value for name, value in found.items() if _is_column(value)}
    if isinstance(found, list) and found and all(isinstance(row, dict) for row in found):
        names = dict.fromkeys(name for row in found for name in row)
        return {name: [row.get(name) for row in found] for name in names}
    return {}


def _columns_below(path: Path, header: Mapping[str, Any]) -> dict[str, Sequence[Any]]:
    """Columns of the one table in an object."""
    tables = {name: columns for name, value in header.items() if (columns := _columns(value))}
    if len(tables) > 1:
        raise ImportDataError(f"{path}: found the tables {', '.join(tables)}, expected one")
    return next(iter(tables.values()), {})


def _is_column(value: object) -> bool:
    return isinstance(value, list) and not any(isinstance(cell, list | dict) for cell in value)


def _cells(values: Sequence[Any]) -> np.ndarray[Any, Any]:
    return np.array([np.nan if cell is None else cell for cell in values])


def _numbers(header: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, float]]:
    """Single numbers by name; those of an inner object as `object.name`."""
    for name, value in header.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{before}{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            with suppress(OverflowError):  # a number of hundreds of digits is a name, not a value
                yield before + name, float(value)
