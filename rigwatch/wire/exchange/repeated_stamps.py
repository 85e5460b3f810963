"""Time stamps that repeat: of a record that is written twice, or a clock coarser than the samples.

A row that repeats the row before in every column counts once. Other rows that share a stamp are
spread evenly from it to the next.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.exchange.tables import Table


@dataclass(frozen=True, slots=True)
class Stamps:
    """Increasing times of a table's rows.

    Attributes:
        times: of the rows that count [s].
        kept: shape (rows,), the rows that count.
        remarks: changes, in words.
    """

    times: FloatArray
    kept: NDArray[np.bool_]
    remarks: tuple[str, ...] = ()


def increasing(table: Table, column: str, times: FloatArray, columns: Sequence[str]) -> Stamps:
    """The times with repetitions resolved.

    Args:
        table: the recording.
        column: of the time, for errors.
        times: shape (rows,) [s].
        columns: the others that are read.

    Raises:
        ImportDataError: a time lies before the previous one; the place is named.
    """
    steps = np.diff(times)
    if (steps > 0).all():
        return Stamps(times, np.ones(len(times), bool))
    back = np.flatnonzero(steps < 0)
    if len(back):
        row = int(back[0]) + 1
        raise ImportDataError(
            f"{table.place(row, column)}: found {times[row]:.9g} s after {times[row - 1]:.9g} s,"
            " expected increasing time (one recording a file?)"
        )
    kept = ~_doubled(table, times, columns)
    spread, shared = _spread(times[kept])
    doubled = int(np.count_nonzero(~kept))
    remarks = (
        *([f"{doubled} rows repeat the row before and count once"] * bool(doubled)),
        *([f"{shared} rows with the time of the row before are spread to the next"] * bool(shared)),
    )
    return Stamps(spread, kept, remarks)


def _doubled(table: Table, times: FloatArray, columns: Sequence[str]) -> NDArray[np.bool_]:
    """Rows that equal the row before in time and in all columns."""
    same = np.concatenate([[False], np.diff(times) == 0])
    for name in columns:
        cells = np.asarray(table.cells[name])
        if len(cells) == len(times):
            same[1:] &= cells[1:] == cells[:-1]
    return same


def _spread(times: FloatArray) -> tuple[FloatArray, int]:
    """Times of which those that are equal lie evenly up to the next; how many were moved."""
    firsts = np.flatnonzero(np.concatenate([[True], np.diff(times) > 0]))
    shared = len(times) - len(firsts)
    if not shared:
        return times, 0
    if len(firsts) == 1:
        raise ImportDataError(
            f"time: found {times[0]:.9g} s in every row, expected increasing time"
        )
    values = times[firsts]
    last = values[-1] + np.median(np.diff(values))
    rows = np.append(firsts, len(times))
    return np.interp(np.arange(len(times)), rows, np.append(values, last)), shared
