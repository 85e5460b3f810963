"""Filling, copying and shifting short rows of numbers in place, inside kernels.

These are loops, as numba takes several times longer to compile assignments of whole slices.
"""

from typing import Any

from numpy.typing import NDArray

from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.kernel import part


@part()
def fill(row: NDArray[Any], value: float) -> None:
    """Set every entry of a row, shape (n,), of numbers or counts."""
    for i in range(row.size):
        row[i] = value


@part()
def fill_rows(rows: FloatArray, value: float) -> None:
    """Set every entry of several rows, shape (m, n)."""
    for i in range(rows.shape[0]):
        fill(rows[i], value)


@part()
def copy(source: FloatArray, to: FloatArray) -> None:
    """Copy a row to another, both of shape (n,)."""
    for i in range(source.size):
        to[i] = source[i]


@part()
def copy_rows(source: FloatArray, to: FloatArray) -> None:
    """Copy several rows to others, both of shape (m, n)."""
    for i in range(source.shape[0]):
        copy(source[i], to[i])


@part()
def push(row: FloatArray, newest: float) -> None:
    """Move every entry of a row, shape (n,), one place to the front, and append the newest."""
    for i in range(row.size - 1):
        row[i] = row[i + 1]
    row[row.size - 1] = newest
