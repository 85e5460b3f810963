"""A recorded session as the record of a structure: its channels are the signals and loads.

Samples are placed by their sequence numbers; lost samples, and samples flagged invalid by device or
monitor, are NaN.
"""

from pathlib import Path

import numpy as np

from rigwatch.structures.records.record import Record, read_record, record_of
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.exchange import AMBIGUOUS, conversion
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.session import SUFFIX, open_session

TABLES = {".csv", ".npz"}


def read_any(path: Path | str) -> Record:
    """The record in a table (.csv, .npz), or in a session: a file (.mcap) or folder of segments.

    Raises:
        SessionError: there is no session at the path.
        ImportDataError: the file cannot be read, or its samples are not one evenly sampled series.
    """
    file = Path(path)
    return read_record(file) if file.suffix in TABLES else record_of_session(file)


def record_of_session(path: Path) -> Record:
    """The samples of a session, the first at t = 0; errors as of `read_any`."""
    blocks = list(open_session(path).samples())
    if not blocks:
        raise ImportDataError(f"{path}: found no samples, expected a recorded structure ({SUFFIX})")
    first = blocks[0]
    if any((b.device, b.boot) != (first.device, first.boot) for b in blocks):
        devices = ", ".join(dict.fromkeys(b.device for b in blocks))
        raise ImportDataError(
            f"{path}: found several devices or restarts ({devices}), expected one unbroken series;"
            " see `rigwatch trim`"
        )
    count = max(block.seq + len(block) for block in blocks) - first.seq
    names = {column.name for block in blocks for column in block.channels}
    columns = {name: np.full(count, np.nan) for name in sorted(names)}
    clock = np.full(count, np.nan)
    for block in blocks:
        _place(block, block.seq - first.seq, columns, clock)
    known = np.isfinite(clock)
    rows = np.arange(count)
    time = np.interp(rows, rows[known], clock[known])
    return record_of(time - time[0], columns, str(path))


def _place(block: SampleBlock, at: int, columns: dict[str, FloatArray], clock: FloatArray) -> None:
    rows = slice(at, at + len(block))
    clock[rows] = np.asarray(block.device_us, np.float64) * 1e-6
    for column in block.channels:
        columns[column.name][rows] = _in_si(column)


def _in_si(column: Column) -> FloatArray:
    """Valid values in SI; unconverted if the unit is unknown.

    Raises:
        ImportDataError: the unit is g, which may be gravity or the gram.
    """
    try:
        to_si = conversion(column.unit, column.name)
    except ImportDataError:
        if column.unit in AMBIGUOUS:
            raise
        return column.usable()
    if (to_si.factor, to_si.offset) == (1.0, 0.0):
        return column.usable()
    return column.usable() * to_si.factor + to_si.offset
