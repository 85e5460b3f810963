"""Tables of the index as Parquet: their columns, and how they are written and read.

Times are UTC without a zone, which every reader takes as they are.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from rigwatch.wire.errors import ArchiveError, MissingExtraError

_TEXT, _WHOLE, _REAL, _TRUTH, _TIME, _TEXTS = "text", "whole", "real", "truth", "time", "texts"
SESSION_COLUMNS = {
    "session": _TEXT,
    "rig": _TEXT,
    "status": _TEXT,
    "remark": _TEXT,
    "start": _TIME,
    "end": _TIME,
    "duration_s": _REAL,
    "rate_hz": _REAL,
    "samples": _WHOLE,
    "missing": _WHOLE,
    "gaps": _WHOLE,
    "restarts": _WHOLE,
    "good": _REAL,
    "damaged_bytes": _WHOLE,
    "estimates": _TRUTH,
    "raised": _TEXTS,
    "probably_missing": _TEXTS,
    "software": _TEXT,
    "configuration": _TEXT,
    "notes": _TEXT,
    "segments": _WHOLE,
    "bytes": _WHOLE,
    "content": _TEXT,
    "stamp": _TEXT,
    "files": _TEXTS,
    "going": _TEXTS,
}
ALARM_COLUMNS = {
    "session": _TEXT,
    "rig": _TEXT,
    "time": _TIME,
    "name": _TEXT,
    "state": _TEXT,
    "severity": _TEXT,
    "cause": _TEXT,
    "value": _REAL,
    "low": _REAL,
    "high": _REAL,
    "user": _TEXT,
}
LOSS_COLUMNS = {
    "session": _TEXT,
    "rig": _TEXT,
    "time": _TIME,
    "what": _TEXT,
    "count": _WHOLE,
    "reason": _TEXT,
}


def pyarrow() -> tuple[Any, Any]:
    """The modules `pyarrow` and `pyarrow.parquet`.

    Raises:
        MissingExtraError: they are not installed.
    """
    try:
        import pyarrow as arrow
        from pyarrow import parquet
    except ImportError:
        raise MissingExtraError("pyarrow", "archive", "an archive") from None
    return arrow, parquet


def write_rows(file: Path, columns: dict[str, str], rows: Iterable[dict[str, Any]]) -> None:
    """Write rows as a table; a missing value is null."""
    arrow, parquet = pyarrow()
    types = {
        _TEXT: arrow.string(),
        _WHOLE: arrow.int64(),
        _REAL: arrow.float64(),
        _TRUTH: arrow.bool_(),
        _TIME: arrow.timestamp("us"),
        _TEXTS: arrow.list_(arrow.string()),
    }
    schema = arrow.schema([(name, types[kind]) for name, kind in columns.items()])
    parquet.write_table(arrow.Table.from_pylist(list(rows), schema), file, compression="zstd")


def read_rows(file: Path) -> list[dict[str, Any]]:
    """The rows of a table.

    Raises:
        ArchiveError: it is no table of an index.
    """
    arrow, parquet = pyarrow()
    try:
        rows: list[dict[str, Any]] = parquet.read_table(file).to_pylist()
    except (arrow.ArrowException, OSError) as error:
        raise ArchiveError(f"{file.name}: is no table of an index: {error}") from None
    return rows


def write_seconds(file: Path, table: dict[str, Any]) -> None:
    """Write figures per second; texts that repeat and the slowly growing time take no room.

    Args:
        file: the new file.
        table: arrays by column; of `name` and `unit` each text with the number of its rows.
    """
    arrow, parquet = pyarrow()
    found = arrow.table(
        {
            "name": _repeated(arrow, table["name"]),
            "unit": _repeated(arrow, table["unit"]),
            "second": arrow.array(table["second"] * 1_000_000).cast(arrow.timestamp("us")),
            "count": arrow.array(table["count"]),
            **{name: arrow.array(table[name]) for name in ("mean", "low", "high")},
        }
    )
    parquet.write_table(
        found,
        file,
        compression="zstd",
        row_group_size=86_400,
        use_dictionary=["name", "unit"],
        column_encoding={"second": "DELTA_BINARY_PACKED"},
    )


def _repeated(arrow: Any, runs: list[tuple[str, int]]) -> Any:
    """A column of texts from each text and how often it follows."""
    texts = sorted({text for text, _ in runs})
    places = [texts.index(text) for text, _ in runs]
    indices = np.repeat(np.array(places, np.int32), [count for _, count in runs])
    return arrow.DictionaryArray.from_arrays(arrow.array(indices), arrow.array(texts))
