"""Blocks of estimates of many rigs as joined messages, written by one compiled call.

The bytes are those of `join`, of blocks as `encode` writes them with their marks.
"""

# Compiled functions are untyped to mypy.
# mypy: disable-error-code="no-any-return"

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.bus import LARGEST_JOINED, MOST_PARTS
from rigwatch.wire.kernel import kernel, part
from rigwatch.wire.messages import ByteArray
from rigwatch.wire.packed_numbers import WORD, put_word
from rigwatch.wire.rows.estimate_rows import (
    LONGEST_HEAD,
    EstimateHeads,
    Heads,
    estimate_size,
    source_head,
    write_block,
)
from rigwatch.wire.rows.named_rows import LONGEST_ID

_HEAD, _LENGTHS, _MARK = 2, 8, 16


class Senders(NamedTuple):
    """What the messages of each row begin with.

    Attributes:
        ids, id_size: of the rigs, shape (rows, LONGEST_ID) and (rows,).
        sources, source_size: device and boot, shape (rows, LONGEST_HEAD) and (rows,).
        runs, numbers: of the next message, shape (rows,).
    """

    ids: ByteArray
    id_size: IntArray
    sources: ByteArray
    source_size: IntArray
    runs: IntArray
    numbers: IntArray


class Blocks(NamedTuple):
    """Blocks of k rows, one after the other.

    Attributes:
        rows: whose they are, shape (k,).
        samples, first: their number, and that of the first one, shape (k,).
        at: the samples before those of each, in `t_ns`, shape (k,).
        t_ns: their times, as bytes.
        columns: values of all columns of each, as bytes: those of one block after the other.
        columns_at: where those of each begin [bytes], shape (k,).
    """

    rows: IntArray
    samples: IntArray
    first: IntArray
    at: IntArray
    t_ns: ByteArray
    columns: ByteArray
    columns_at: IntArray


class EstimateRows:
    """Writes the estimates of a process's rigs.

    Args:
        count: rows.
        names: name and unit of each column.
        longest: samples of the longest block.
    """

    def __init__(self, count: int, names: tuple[tuple[str, str], ...], longest: int) -> None:
        self._heads = EstimateHeads(names, longest).arrays
        self._columns = len(names)
        self.senders = Senders(
            np.zeros((count, LONGEST_ID), np.uint8),
            np.zeros(count, np.int64),
            np.zeros((count, LONGEST_HEAD), np.uint8),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
            np.zeros(count, np.int64),
        )

    def begin(self, row: int, rig: str, source: tuple[str, int], place: tuple[int, int]) -> bool:
        """A row's next messages are of this rig and its device and boot, from a run and number on.

        False if the device's name is too long for a row.
        """
        head = source_head(*source)
        if len(head) > LONGEST_HEAD:
            return False
        self.senders.ids[row, : len(rig)] = np.frombuffer(rig.encode(), np.uint8)
        self.senders.id_size[row] = len(rig)
        self.senders.sources[row, : len(head)] = np.frombuffer(head, np.uint8)
        self.senders.source_size[row] = len(head)
        self.senders.runs[row], self.senders.numbers[row] = place
        return True

    def written(self, blocks: Blocks) -> tuple[list[bytes], IntArray]:
        """Joined messages of these blocks, and where each block lies: message, begin and end.

        The rows' numbers go on.
        """
        count = len(blocks.rows)
        samples, widest = int(blocks.samples.sum()), self._heads.columns.shape[1]
        largest = _LENGTHS + LONGEST_ID + _MARK + LONGEST_HEAD + widest + 32
        room = _HEAD * (count + 1) + count * largest + WORD * samples * (self._columns + 1)
        out, places = np.empty(room, np.uint8), np.empty((count, 3), np.int64)
        ends = np.empty(count, np.int64)
        made = _write(
            blocks, self.senders, self._heads, out, places, ends, LARGEST_JOINED, MOST_PARTS
        )
        starts = [0, *ends[:made].tolist()]
        found = [out[a:b].tobytes() for a, b in pairwise(starts)]
        return found, places


@part()
def _put_short(out: ByteArray, at: int, value: int) -> None:
    out[at], out[at + 1] = value & 255, value >> 8 & 255


@kernel()
def _write(  # noqa: PLR0917
    blocks: Blocks,
    senders: Senders,
    heads: Heads,
    out: ByteArray,
    places: IntArray,
    ends: IntArray,
    largest: int,
    most: int,
) -> int:
    """Write the messages one after the other; their number, and in `ends` where each ends."""
    count, done, made, begin = blocks.rows.size, 0, 0, 0
    while done < count:
        total, last = 0, done
        while last < count and last - done < most:
            size = _LENGTHS + _part_size(blocks, last, senders, heads)
            if total + size > largest and last > done:
                break
            total, last = total + size, last + 1
        _put_short(out, begin, last - done)
        at = begin + _HEAD + _LENGTHS * (last - done)
        for k in range(done, last):
            row, lengths = blocks.rows[k], begin + _HEAD + _LENGTHS * (k - done)
            _put_short(out, lengths, senders.id_size[row])
            _put_short(out, lengths + 2, _MARK)
            for i in range(senders.id_size[row]):
                out[at + i] = senders.ids[row, i]
            at += senders.id_size[row]
            put_word(out, at, senders.runs[row])
            put_word(out, at + WORD, senders.numbers[row])
            senders.numbers[row] += 1
            at += _MARK
            size = write_block(
                heads,
                senders.sources[row],
                senders.source_size[row],
                blocks.first[k],
                blocks.samples[k],
                blocks.t_ns[WORD * blocks.at[k] :],
                blocks.columns[blocks.columns_at[k] :],
                out[at:],
            )
            _put_short(out, lengths + 4, size & 65535)
            _put_short(out, lengths + 6, size >> 16)
            places[k, 0], places[k, 1], places[k, 2] = made, at - begin, at - begin + size
            at += size
        ends[made] = begin = at
        done, made = last, made + 1
    return made


@part()
def _part_size(blocks: Blocks, k: int, senders: Senders, heads: Heads) -> int:
    """Size of a part without its lengths [bytes]."""
    row = blocks.rows[k]
    size = estimate_size(heads, senders.source_size[row], blocks.first[k], blocks.samples[k])
    return senders.id_size[row] + _MARK + size
