"""Sessions as CSV, Parquet or MAT files, with units in the titles, without loss."""

import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.wire.errors import MissingExtraError, SessionError
from rigwatch.wire.exchange.session_columns import Array, table_columns
from rigwatch.wire.messages import Block, EstimateBlock, is_of_structure
from rigwatch.wire.new_file import new_file
from rigwatch.wire.session import Session

LARGEST_MAT = 1 << 31
"""MAT files of version 5 hold no variable beyond this [bytes]."""
_VARIABLE = re.compile(r"[^A-Za-z0-9_]+")
Tables = Iterator[dict[str, Array]]


@dataclass(frozen=True, slots=True)
class Exported:
    """Result of an export: the file, its rows and the titles of its columns."""

    path: Path
    rows: int
    columns: tuple[str, ...]


def export_session(
    session: Session,
    target: Path,
    *,
    estimates: bool = False,
    device: str | None = None,
    start: int | None = None,
    end: int | None = None,
) -> Exported:
    """The samples (or estimates) of one device as a CSV, Parquet or MAT file, by its ending.

    Args:
        session: the session.
        target: the new file.
        estimates: the monitor's estimates instead of the samples; without any, those of a structure
            that was watched.
        device: name of the device, None if the session has only one.
        start, end: time span [ns].

    Raises:
        SessionError: the ending is unknown, the target exists, or there is nothing to export.
        MissingExtraError: Parquet without pyarrow.
    """
    writer = _WRITERS.get(target.suffix.lower())
    if writer is None:
        known = ", ".join(_WRITERS)
        raise SessionError(f"{target}: unknown format {target.suffix!r}, expected one of {known}")
    deliver = partial(_estimates, session) if estimates else session.samples
    with new_file(target) as part:
        tables = _tables(deliver(device, start, end), session.path)
        first = next(tables, None)
        if first is None:
            kind = "estimates" if estimates else "samples"
            raise SessionError(f"{session.path}: found no {kind} to export")
        rows = writer(part, first, tables)
    return Exported(target, rows, tuple(first))


def _estimates(
    session: Session, device: str | None, start: int | None, end: int | None
) -> Iterator[EstimateBlock]:
    """The estimates of one process: monitor and structure have other columns."""
    found = partial(session.estimates, device, start, end)
    structures = all(map(is_of_structure, found()))
    return (block for block in found() if is_of_structure(block) == structures)


def _tables(found: Iterator[Any], path: Path) -> Tables:
    """Blocks as tables, all of one device and with the same columns."""
    first: Block | None = None
    titles: list[str] = []
    for block in found:
        table = table_columns(block)
        if first is None:
            first, titles = block, list(table)
        if block.device != first.device:
            names = f"{first.device} and {block.device}"
            raise SessionError(f"{path}: found the devices {names}, expected --device with one")
        if list(table) != titles:
            raise SessionError(
                f"{path}: the columns change at boot {block.boot}, seq {block.seq}: trim it first"
            )
        yield table


def _length(table: dict[str, Array]) -> int:
    return len(next(iter(table.values())))


def _write_csv(target: Path, first: dict[str, Array], rest: Tables) -> int:
    rows = 0
    with target.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(first)
        for table in chain([first], rest):
            # Python prints a float with enough digits to restore it exactly.
            writer.writerows(zip(*(column.tolist() for column in table.values()), strict=True))
            rows += _length(table)
    return rows


def _write_parquet(target: Path, first: dict[str, Array], rest: Tables) -> int:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingExtraError("pyarrow", "parquet", "writing Parquet files") from None
    rows = 0
    with parquet.ParquetWriter(target, pyarrow.table(first).schema) as writer:
        for table in chain([first], rest):
            writer.write_table(pyarrow.table(table))
            rows += _length(table)
    return rows


def _write_mat(target: Path, first: dict[str, Array], rest: Tables) -> int:
    """One variable a column, and `column_titles`: "variable=title" of each, with its unit."""
    from scipy.io import savemat  # slow to import

    tables = list(chain([first], rest))
    whole = {name: np.concatenate([table[name] for table in tables]) for name in first}
    if max(column.nbytes for column in whole.values()) >= LARGEST_MAT:
        raise SessionError(f"{target}: too long for a MAT file, trim it or export Parquet")
    names = variable_names(list(first))
    content: dict[str, Any] = {names[name]: column.reshape(-1, 1) for name, column in whole.items()}
    titles = [f"{variable}={name}" for name, variable in names.items()]
    content["column_titles"] = np.array(titles, dtype=object)
    savemat(target, content, appendmat=False, long_field_names=True, do_compression=True)
    return _length(whole)


def variable_names(titles: list[str]) -> dict[str, str]:
    """A MATLAB variable name for each title, all different, at most 31 characters."""
    names: dict[str, str] = {}
    for name in titles:
        base = _VARIABLE.sub("_", name.split(" [")[0]).strip("_")
        base = base if base[:1].isalpha() else f"x{base}"
        variable, number = base[:31], 1
        while variable in names.values():
            number += 1
            variable = f"{base[:27]}_{number}"
        names[name] = variable
    return names


_WRITERS: dict[str, Callable[[Path, dict[str, Array], Tables], int]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".mat": _write_mat,
}
