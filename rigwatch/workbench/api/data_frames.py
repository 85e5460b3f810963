"""Named arrays of numbers, converted from and to data frames.

A table may be given as a mapping of arrays, a pandas or polars data frame, or an xarray data set.
Tables are returned as a mapping of arrays that converts to any of these.
"""

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.errors import ImportDataError, MissingExtraError
from rigwatch.wire.new_file import new_file

EXTRA = "notebook"


class NamedArrays(dict[str, NDArray[Any]]):
    """Named arrays of equal length."""

    def to_pandas(self) -> Any:
        """The columns as a pandas data frame."""
        return _package("pandas").DataFrame(dict(self))

    def to_polars(self) -> Any:
        """The columns as a polars data frame."""
        return _package("polars").DataFrame(dict(self))

    def to_xarray(self) -> Any:
        """The columns as an xarray data set along the first column, such as the time."""
        along, *rest = self
        variables = {name: (along, self[name]) for name in rest}
        return _package("xarray").Dataset(variables, coords={along: self[along]})


def columns_from(table: Any, name: str) -> NamedArrays:
    """The columns of a table.

    Args:
        table: a mapping of arrays, a pandas or polars data frame, or an xarray data set.
        name: of the table, for errors.

    Raises:
        ImportDataError: it is none of these, or its columns differ in length.
    """
    if hasattr(table, "data_vars"):
        found = {_headed(table[key]): table[key] for key in (*table.coords, *table.data_vars)}
    elif isinstance(table, Mapping):
        found = dict(table)
    elif hasattr(table, "columns") and hasattr(table, "__getitem__"):
        index = getattr(getattr(table, "index", None), "name", None)
        found = {str(index): table.index} if index else {}
        found |= {str(key): table[key] for key in table.columns}
    else:
        kinds = "arrays by name, a pandas or polars data frame, or an xarray data set"
        raise ImportDataError(f"{name}: found {type(table).__name__}, expected {kinds}")
    columns = NamedArrays(dict(_seconds(key, np.asarray(value)) for key, value in found.items()))
    shapes = {value.shape for value in columns.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1:
        described = ", ".join(f"{key} {value.shape}" for key, value in columns.items())
        raise ImportDataError(f"{name}: found {described}, expected columns of one length")
    return columns


def write_csv(columns: NamedArrays, path: Path) -> None:
    """Write columns as a CSV file, every number with all its digits."""
    with new_file(path, replace=True) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(value.tolist() for value in columns.values()), strict=True))


def records(rows: Iterable[Mapping[str, object]]) -> NamedArrays:
    """Rows as columns; None is NaN."""
    listed = list(rows)
    keys = list(listed[0]) if listed else []
    return NamedArrays({key: _array([row[key] for row in listed]) for key in keys})


def _array(values: list[Any]) -> NDArray[Any]:
    if any(value is None for value in values):
        return np.array([np.nan if value is None else value for value in values], np.float64)
    return np.array(values)


def _headed(variable: Any) -> str:
    """The header of an xarray variable, with its unit if it has one."""
    unit = variable.attrs.get("units", "")
    return f"{variable.name}[{unit}]" if unit else str(variable.name)


def _seconds(name: str, values: NDArray[Any]) -> tuple[str, NDArray[Any]]:
    """Times and time differences as seconds from the first."""
    if values.dtype.kind not in "mM":
        return name, values
    since = (values - values[:1]) / np.timedelta64(1, "ns")
    return f"{name}[s]", since * 1e-9


def _package(name: str) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError:
        raise MissingExtraError(name, EXTRA, f"converting to {name}") from None
