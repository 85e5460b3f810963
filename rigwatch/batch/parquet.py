"""Results as a Parquet table: one row per unit, a column for each plain figure of its result.

path, content, work, kind, error    as in the lines
value                               the whole result as JSON
<name>                              each top-level number, text or truth value of the results
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.wire.errors import BatchError, MissingExtraError

FIXED = ("path", "content", "work", "kind", "error", "value")
_ROWS = 4096
"""Rows of a group."""


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingExtraError("pyarrow", "parquet", "results in Parquet") from None
    return pyarrow, parquet


def lines_of(file: Path) -> Iterator[bytes]:
    """The lines that a table was written from.

    Raises:
        BatchError: it is not such a table.
    """
    pyarrow, parquet = _pyarrow()
    try:
        table = parquet.ParquetFile(file)
        for batch in table.iter_batches(columns=list(FIXED)):
            for row in batch.to_pylist():
                yield _line(row)
    except (pyarrow.ArrowException, OSError, KeyError, ValueError):
        text = "is no table of results, expected another name for new results"
        raise BatchError(f"{file}: {text}") from None


def _line(row: dict[str, Any]) -> bytes:
    value = row.pop("value")
    whole = {name: row[name] for name in ("path", "content", "work")}
    whole["value"] = msgspec.Raw((value or "null").encode())
    whole |= {name: row[name] for name in ("kind", "error") if row[name]}
    return msgspec.json.encode(whole) + b"\n"


def write_parquet(file: Path, lines: Iterable[bytes]) -> None:
    """Write results as a table; the same lines give the same bytes."""
    pyarrow, parquet = _pyarrow()
    rows = [_row(line) for line in lines]
    schema = _schema(pyarrow, rows)
    with parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for start in range(0, len(rows), _ROWS):
            part = [_fitted(row, schema) for row in rows[start : start + _ROWS]]
            writer.write_table(pyarrow.Table.from_pylist(part, schema))


def _row(line: bytes) -> dict[str, Any]:
    found = msgspec.json.decode(line, type=dict[str, msgspec.Raw])
    row: dict[str, Any] = {name: _text(found.get(name)) for name in FIXED[:5]}
    row["value"] = None if row["kind"] else bytes(found["value"]).decode()
    return _plain(msgspec.json.decode(found["value"])) | row


def _text(raw: msgspec.Raw | None) -> str:
    return "" if raw is None else str(msgspec.json.decode(raw))


def _plain(figures: Any) -> dict[str, Any]:
    if not isinstance(figures, dict):
        return {}
    kinds = (bool, int, float, str)
    return {name: value for name, value in figures.items() if isinstance(value, kinds)}


def _schema(pyarrow: Any, rows: list[dict[str, Any]]) -> Any:
    kinds: dict[str, set[type]] = {}
    for row in rows:
        for name, value in row.items():
            kinds.setdefault(name, set()).add(type(value))
    names = [*FIXED, *sorted(set(kinds) - set(FIXED))]
    return pyarrow.schema([(name, _type(pyarrow, kinds.get(name, set()))) for name in names])


def _type(pyarrow: Any, kinds: set[type]) -> Any:
    kinds = kinds - {type(None)}
    if kinds == {bool}:
        return pyarrow.bool_()
    if kinds == {int}:
        return pyarrow.int64()
    if kinds and kinds <= {int, float}:
        return pyarrow.float64()
    return pyarrow.string()


def _fitted(row: dict[str, Any], schema: Any) -> dict[str, Any]:
    """The row with values that only text can hold together as text."""
    return {
        field.name: str(value) if field.type == "string" and value is not None else value
        for field in schema
        for value in [row.get(field.name)]
    }
