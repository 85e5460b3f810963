"""Inspects a foreign file before import: its columns, and a suitable mapping."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rigwatch.wire.errors import ImportDataError, RigwatchError
from rigwatch.wire.exchange import ImportMapping, columns_of, parse_source
from rigwatch.wire.typed_files import find_file, load, shipped_names

SHOWN = 5
"""Number of values shown per column."""


@dataclass(frozen=True)
class FileContents:
    """Content of a file.

    Attributes:
        columns: name, first values and range of each.
        scalars: single numbers in the file.
        mapping: name of the best matching shipped mapping, empty if none matches.
        suggested: that mapping, or a draft of one.
        rows: of the longest column.
    """

    columns: list[dict[str, Any]]
    scalars: dict[str, float]
    mapping: str
    suggested: dict[str, Any]
    rows: int


def contents_of(path: Path) -> FileContents:
    """Inspect a CSV, MAT, Parquet or JSON file.

    Raises:
        ImportDataError: it cannot be read.
    """
    cells, scalars = columns_of(path)
    name, mapping = _fitting(path, list(cells))
    columns = [_column(name, values) for name, values in cells.items()]
    rows = max((len(values) for values in cells.values()), default=0)
    return FileContents(columns, scalars, name, msgspec.to_builtins(mapping), rows)


def _column(name: str, values: Any) -> dict[str, Any]:
    shown = [str(value) for value in values[:SHOWN]]
    try:
        numbers = np.asarray(values).astype(np.float64)
        ends = [float(np.nanmin(numbers)), float(np.nanmax(numbers))]
    except (ValueError, TypeError):
        return {"name": name, "shown": shown, "low": None, "high": None}
    return {"name": name, "shown": shown, "low": ends[0], "high": ends[1]}


def _fitting(path: Path, columns: list[str]) -> tuple[str, ImportMapping]:
    """The shipped mapping that uses most columns of the file, if the file has all of them."""
    found: list[tuple[int, str, ImportMapping]] = []
    for name in shipped_names("imports"):
        mapping = load(find_file(name, "imports"), ImportMapping)
        try:
            taken = _taken(mapping, tuple(columns))
        except RigwatchError:
            continue
        wrong = mapping.format not in ("auto", path.suffix.lower().removeprefix("."))
        if taken and not wrong:
            found.append((taken, name, mapping))
    if not found:
        return "", _beginning(columns)
    _, name, mapping = max(found, key=lambda entry: entry[0])
    return name, mapping


def _taken(mapping: ImportMapping, columns: tuple[str, ...]) -> int:
    if mapping.time and mapping.time.partition("[")[0].strip() not in columns:
        raise ImportDataError("another file")
    sources = [parse_source(n, text, columns) for n, text in mapping.channels.items()]
    return len({source.column for source in sources})


def _beginning(columns: list[str]) -> ImportMapping:
    """A draft mapping: the first column as time, the others as channels without units."""
    names = {c: "".join(ch if ch.isalnum() or ch in "_-" else "_" for ch in c) for c in columns}
    channels = {names[c]: f"{c}[1]" for c in columns[1:] if names[c]}
    time = f"{columns[0]}[s]" if columns else ""
    return ImportMapping(time=time, channels=channels)
