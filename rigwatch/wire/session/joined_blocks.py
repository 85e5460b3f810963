"""Decodes the blocks of a recording many at a time.

    payloads ──by length──▶ tables of bytes ──compared, numbered──▶ runs ──copied──▶ joined blocks

A recording has a block for each 0.4 s, and few layouts of them. The bytes that do not change are
compared, and the numbers copied, for all payloads of a layout at once: one at a time, the objects
around a block cost several times as much as its numbers.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.arrays import BoolArray, IntArray
from rigwatch.wire.messages import (
    UNFAMILIAR,
    ByteArray,
    EstimateBlock,
    Layout,
    Numbers,
    SampleBlock,
    block_of,
    decode_block,
    layout_of,
)

K = TypeVar("K", SampleBlock, EstimateBlock)
FEWEST = 4
"""Payloads of one length below which each is decoded on its own."""
_WORD = 8
"""Size of a time or value [bytes]."""


@dataclass(frozen=True, slots=True)
class _Table:
    """Payloads of one length, in the order of their places, and the layout of the first.

    Attributes:
        layout: also of the others that share its bytes.
        raw: the bytes, a payload in each row.
        places: of the rows among all payloads.
        sender: device and boot of the first, and its columns.
    """

    layout: Layout
    raw: ByteArray
    places: NDArray[np.intp]
    sender: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class _Index:
    """Where each of m payloads is found.

    Attributes:
        tables: of those that are alike.
        table, row: its place in them, -1 if it is in none, shape (m,).
        follows: whether it continues the one before, shape (m,).
    """

    tables: Sequence[_Table]
    table: NDArray[np.intp]
    row: NDArray[np.intp]
    follows: BoolArray


def joined_blocks(kind: type[K], payloads: Iterable[bytes], size: int) -> Iterator[K]:
    """The blocks in `payloads`, joined up to about `size` samples where one continues another.

    Arrays of blocks that are not joined may be views of the payload.

    Raises:
        MessageError: a payload is not such a message, or its columns differ in length.
    """
    waiting: list[bytes] = []
    samples: dict[int, int] = {}
    count = 0
    for data in payloads:
        waiting.append(data)
        if len(data) not in samples:
            samples[len(data)] = _samples_in(kind, data)
        count += samples[len(data)]
        if count >= size:
            yield from _decoded(kind, waiting)
            waiting, samples, count = [], {}, 0
    if waiting:
        yield from _decoded(kind, waiting)


def _samples_in(kind: type[Any], data: bytes) -> int:
    """Samples of a block, at least one."""
    try:
        return max(1, layout_of(kind, data).samples)
    except UNFAMILIAR:
        return 1


def _decoded(kind: type[K], payloads: Sequence[bytes]) -> Iterator[K]:
    index = _index(kind, payloads)
    begins: list[int] = np.flatnonzero(~index.follows).tolist()
    for first, last in pairwise([*begins, len(payloads)]):
        if index.table[first] < 0:
            yield decode_block(kind, payloads[first])
            continue
        table = index.tables[index.table[first]]
        head = table.layout.head(payloads[first])
        yield block_of(kind, table.layout, head, _numbers(index, first, last))


def _index(kind: type[Any], payloads: Sequence[bytes]) -> _Index:
    tables = list(_tables(kind, payloads))
    m = len(payloads)
    at = _Index(tables, np.full(m, -1), np.full(m, -1), np.zeros(m, np.bool_))
    first, after, sender, begin_ns, end_ns = np.zeros((5, m), np.int64)
    senders: dict[Any, int] = {}
    for number, table in enumerate(tables):
        seq, alike = _compared(table)
        places = table.places[alike]
        at.table[places], at.row[places] = number, np.flatnonzero(alike)
        first[places], after[places] = seq[alike], seq[alike] + table.layout.samples
        begin_ns[places], end_ns[places] = (ns[alike] for ns in _times(table))
        sender[places] = senders.setdefault(table.sender, len(senders))
    known = at.table >= 0
    at.follows[1:] = known[1:] & known[:-1]
    at.follows[1:] &= (first[1:] == after[:-1]) & (sender[1:] == sender[:-1])
    at.follows[1:] &= begin_ns[1:] >= end_ns[:-1]  # else the clock was set back
    return at


def _tables(kind: type[Any], payloads: Sequence[bytes]) -> Iterator[_Table]:
    """A table for each length that enough payloads have."""
    lengths: dict[int, list[int]] = {}
    for place, data in enumerate(payloads):
        lengths.setdefault(len(data), []).append(place)
    for places in lengths.values():
        if len(places) < FEWEST:
            continue
        try:
            layout = layout_of(kind, payloads[places[0]])
            device, boot, _ = layout.head(payloads[places[0]])
        except UNFAMILIAR:
            continue
        raw = np.frombuffer(b"".join([payloads[place] for place in places]), np.uint8)
        yield _Table(
            layout, raw.reshape(len(places), -1), np.array(places), (device, boot, layout.names)
        )


def _compared(table: _Table) -> tuple[IntArray, BoolArray]:
    """The first number of each row, and whether the row has the layout and sender of the first."""
    seq, alike = table.layout.first_numbers(table.raw)
    shared = table.raw[:, table.layout.shared]
    return seq, alike & (shared == shared[0]).all(axis=1)


def _times(table: _Table) -> tuple[IntArray, IntArray]:
    """Unix time of the first and of the last sample of each row [ns]; none follows without any."""
    begin, samples = table.layout.times[-1], table.layout.samples
    if not samples:
        none = np.zeros(len(table.raw), np.int64)
        return none + np.iinfo(np.int64).min, none + np.iinfo(np.int64).max
    rows = np.ascontiguousarray(table.raw[:, begin : begin + _WORD * samples]).view("<i8")
    return rows[:, 0], rows[:, -1]


def _numbers(index: _Index, first: int, last: int) -> Numbers:
    """The numbers of payloads `first` to before `last`, each of which continues the one before."""
    tables = index.table[first:last]
    cuts = [0, *(np.flatnonzero(np.diff(tables)) + 1).tolist(), last - first]
    layouts = [index.tables[number].layout for number in tables]
    n, shape = sum(layout.samples for layout in layouts), layouts[0]
    quality = sum(judged for _, _, judged in shape.names)
    to: Numbers = (
        np.empty((len(shape.times), n), np.int64),
        np.empty((len(shape.columns), n)),
        np.empty((quality, n), np.uint8),
    )
    done = 0
    for begin, end in pairwise(cuts):
        table, row = index.tables[tables[begin]], index.row[first + begin]
        rows = table.raw[row : row + end - begin]
        _copy(table.layout, rows, to, done)
        done += len(rows) * table.layout.samples
    return to


def _copy(layout: Layout, rows: ByteArray, to: Numbers, done: int) -> None:
    """Copy the numbers of these payloads to their places behind `done` samples."""
    span = slice(done, done + len(rows) * layout.samples)
    flags = [column.quality for column in layout.columns if column.quality >= 0]
    values = [column.values for column in layout.columns]
    for starts, numbers, size in (
        (layout.times, to[0], _WORD),
        (values, to[1], _WORD),
        (flags, to[2], 1),
    ):
        width = size * layout.samples
        for start, row in zip(starts, numbers, strict=True):
            place = row[span].view(np.uint8).reshape(len(rows), width)
            place[:] = rows[:, start : start + width]
