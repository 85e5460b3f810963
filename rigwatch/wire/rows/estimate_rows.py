"""Writes blocks of estimates whose columns are the rows of one array, as `encode` does."""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.kernel import part
from rigwatch.wire.messages import (
    ByteArray,
    EstimateBlock,
    PlainNames,
    estimate_heads,
    estimate_tags,
    source_bytes,
)
from rigwatch.wire.packed_numbers import WORD

LONGEST_HEAD = 256
"""Bytes for device and boot of a row."""
_LONGEST_NUMBER = 10


class Heads(NamedTuple):
    """What precedes the arrays of a block of each length up to one.

    Attributes:
        times: before the times, shape (lengths, any), of which `times_size` bytes count.
        columns: before each column's values, one after the other, shape (lengths, any).
        ends: where each ends in `columns`, shape (lengths, columns); zeros where it is not known.
        seq_tag: the byte before the number.
    """

    times: ByteArray
    times_size: IntArray
    columns: ByteArray
    ends: IntArray
    seq_tag: int


class EstimateHeads:
    """The heads of blocks with these columns.

    Args:
        names: name and unit of each column.
        longest: samples of the longest block.
    """

    def __init__(self, names: PlainNames, longest: int) -> None:
        self._names = names
        found = [estimate_heads(names, WORD * n) for n in range(1, longest + 1)]
        widest = max(len(b"".join(columns)) for _, columns in found)
        self.arrays = Heads(
            np.zeros((longest + 1, _LONGEST_NUMBER + 1), np.uint8),
            np.zeros(longest + 1, np.int64),
            np.zeros((longest + 1, widest), np.uint8),
            np.zeros((longest + 1, len(names)), np.int64),
            estimate_tags()[2][0],
        )
        for n, (times, columns) in enumerate(found, 1):
            whole = b"".join(columns)
            self.arrays.times[n, : len(times)] = np.frombuffer(times, np.uint8)
            self.arrays.times_size[n] = len(times)
            self.arrays.columns[n, : len(whole)] = np.frombuffer(whole, np.uint8)
            self.arrays.ends[n] = np.cumsum([len(head) for head in columns])


def source_head(device: str, boot: int) -> bytes:
    """What the estimates of a boot begin with."""
    return source_bytes(EstimateBlock, device, boot)


@part()
def estimate_size(heads: Heads, source: int, seq: int, n: int) -> int:
    """Size of a block of n samples [bytes], `source` of which are its device and boot."""
    columns = heads.ends.shape[1]
    number = _number_size(seq) + 1 if seq != 0 else 0
    return source + number + heads.times_size[n] + heads.ends[n, -1] + WORD * n * (columns + 1)


@part()
def write_block(  # noqa: PLR0917
    heads: Heads,
    source: ByteArray,
    source_size: int,
    seq: int,
    n: int,
    t_ns: ByteArray,
    values: ByteArray,
    out: ByteArray,
) -> int:
    """Write a block.

    Args:
        heads: of its columns.
        source, source_size: from `source_head`.
        seq: number of its first sample, not negative.
        n: its samples.
        t_ns, values: the bytes of its times, and of all columns one after the other.
        out: filled from its beginning.

    Returns:
        Its size [bytes].
    """
    at = _copied(source, 0, source_size, out, 0)
    if seq != 0:
        out[at] = heads.seq_tag
        at = _written(seq << 1, out, at + 1)
    at = _copied(heads.times[n], 0, heads.times_size[n], out, at)
    at = _copied(t_ns, 0, WORD * n, out, at)
    begin = 0
    for c in range(heads.ends.shape[1]):
        end = heads.ends[n, c]
        at = _copied(heads.columns[n], begin, end, out, at)
        at = _copied(values, WORD * n * c, WORD * n * (c + 1), out, at)
        begin = end
    return at


@part()
def _copied(source: ByteArray, begin: int, end: int, out: ByteArray, at: int) -> int:
    """Copy bytes; where they end."""
    for k in range(end - begin):
        out[at + k] = source[begin + k]
    return at + end - begin


@part()
def _number_size(seq: int) -> int:
    size, rest = 1, (seq << 1) >> 7
    while rest > 0:
        size, rest = size + 1, rest >> 7
    return size


@part()
def _written(value: int, out: ByteArray, at: int) -> int:
    """Write a varint; where it ends."""
    while value >= 128:
        out[at] = value & 127 | 128
        value >>= 7
        at += 1
    out[at] = value
    return at + 1
