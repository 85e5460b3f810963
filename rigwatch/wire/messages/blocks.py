"""Cuts, joins and orders blocks of samples or estimates, without changing a value.

A block holds consecutive samples `seq`, `seq + 1`, … of one boot of one device, whose times do not
go back. Two blocks are joined only if the second continues the first and has the same columns.

The estimates of two processes for the same samples, of a monitor and of a watched structure, have
no column in common: they are two streams, each with numbers that go on (`Streams`).
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.messages.message_types import (
    STATISTIC,
    Column,
    ColumnTable,
    EstimateBlock,
    SampleBlock,
)

Block = SampleBlock | EstimateBlock
B = TypeVar("B", SampleBlock, EstimateBlock)


def columns_of(block: Block) -> Sequence[Column]:
    """The columns of a block of either kind."""
    return block.channels if isinstance(block, SampleBlock) else block.columns


def continues(first: Block, second: Block) -> bool:
    """Whether `second` begins with the sample after `first`, not earlier, with the same columns."""
    return (
        second.seq == first.seq + len(first)
        and second.boot == first.boot
        and second.device == first.device
        and type(second) is type(first)
        and not _goes_back(first, second)
        and _same_layout(columns_of(first), columns_of(second))
    )


def _goes_back(first: Block, second: Block) -> bool:
    """Whether the clock was set back between them."""
    return bool(len(first) and len(second) and second.t_ns[0] < first.t_ns[-1])


def _same_layout(first: Sequence[Column], second: Sequence[Column]) -> bool:
    if isinstance(first, ColumnTable) and isinstance(second, ColumnTable):
        return first.names == second.names
    if len(first) != len(second):
        return False
    for a, b in zip(first, second, strict=True):
        if a.name != b.name or a.unit != b.unit or bool(a.quality.size) != bool(b.quality.size):
            return False
    return True


def concatenate(blocks: Sequence[B]) -> B:
    """One block of all samples of `blocks`, each of which continues the one before.

    Raises:
        ValueError: there is no block, or one does not continue its predecessor.
    """
    if not blocks:
        raise ValueError("no block to concatenate")
    for first, second in pairwise(blocks):
        if not continues(first, second):
            raise ValueError(f"the block at seq {second.seq} does not continue the one before it")
    return blocks[0] if len(blocks) == 1 else _joined(blocks)


def _joined(blocks: Sequence[B]) -> B:
    columns = _joined_columns([columns_of(block) for block in blocks])
    head, t_ns = blocks[0], np.concatenate([block.t_ns for block in blocks])
    if isinstance(head, SampleBlock):
        device_us = np.concatenate([block.device_us for block in blocks])
        return SampleBlock(head.device, head.boot, head.seq, device_us, t_ns, columns)
    return EstimateBlock(head.device, head.boot, head.seq, t_ns, columns)


def _joined_columns(blocks: Sequence[Sequence[Column]]) -> Any:
    tables = [columns for columns in blocks if isinstance(columns, ColumnTable)]
    if len(tables) == len(blocks):
        return ColumnTable(tables[0].names, np.hstack([table.values for table in tables]))
    return tuple(_joined_column(part) for part in zip(*blocks, strict=True))


def _joined_column(parts: Sequence[Column]) -> Column:
    values = np.concatenate([part.values for part in parts])
    quality = np.concatenate([part.quality for part in parts])
    return Column(parts[0].name, parts[0].unit, values, quality)


def cut(block: B, first: int, last: int) -> B:
    """Samples `first` to `last - 1` of the block, counted from 0; views, no copies."""
    part = slice(first, last)
    columns = _cut_columns(columns_of(block), part)
    seq, t_ns = block.seq + first, block.t_ns[part]
    if isinstance(block, SampleBlock):
        return SampleBlock(block.device, block.boot, seq, block.device_us[part], t_ns, columns)
    return EstimateBlock(block.device, block.boot, seq, t_ns, columns)


def _cut_columns(columns: Sequence[Column], part: slice) -> Any:
    if isinstance(columns, ColumnTable):
        return columns.cut(part)
    return tuple(
        [Column(one.name, one.unit, one.values[part], one.quality[part]) for one in columns]
    )


def pieces(block: B, size: int) -> Iterator[B]:
    """The block in pieces of at most `size` samples."""
    if len(block) <= size:
        yield block
        return
    for first in range(0, len(block), size):
        yield cut(block, first, min(first + size, len(block)))


def between(block: B, start: int | None, end: int | None) -> B | None:
    """The part of the block with time stamps in [start, end) [ns], None if it is empty.

    If the clock steps inside the block, samples between two of the part are kept.
    """
    if not len(block):
        return None
    inside = _inside(block.t_ns, start, end)
    if inside.all():
        return block
    chosen = np.flatnonzero(inside)
    return cut(block, int(chosen[0]), int(chosen[-1]) + 1) if len(chosen) else None


def _inside(t_ns: NDArray[np.int64], start: int | None, end: int | None) -> NDArray[np.bool_]:
    inside = np.ones(len(t_ns), bool)
    if start is not None:
        inside &= t_ns >= start
    if end is not None:
        inside &= t_ns < end
    return inside


def merged(blocks: Iterable[B], size: int) -> Iterator[B]:
    """Blocks of at least `size` samples that bridge no gap.

    A block that does not continue its predecessor starts a new one, so that every gap, restart of
    the device and change of columns falls between two blocks. Memory is that of one merged block,
    whose arrays are its own or those of the only one that it consists of.
    """
    run: list[B] = []
    length = 0
    for block in blocks:
        if not len(block):
            continue
        if run and (length >= size or not continues(run[-1], block)):
            yield _with_own_arrays(run)
            run, length = [], 0
        run.append(block)
        length += len(block)
    if run:
        yield _with_own_arrays(run)


def _with_own_arrays(run: Sequence[B]) -> B:
    """The blocks as one; a single one is copied only if it is a view of received bytes."""
    alone = len(run) == 1 and run[0].t_ns.flags.writeable
    return run[0] if alone else _joined(run)


def unseen(block: B, next_seq: int | None) -> B | None:
    """The part of the block from `next_seq` on; None if it is empty."""
    if next_seq is None or block.seq >= next_seq:
        return block
    known = next_seq - block.seq
    return cut(block, known, len(block)) if known < len(block) else None


def is_of_structure(block: EstimateBlock) -> bool:
    """Whether a block is about a structure that is watched, and not the monitor's."""
    return any(column.name == STATISTIC for column in block.columns)


class _Stream:
    """A stream of blocks: the names of its columns so far, and the number that comes next."""

    def __init__(self) -> None:
        self.names: set[str] = set()
        self.next_seq: int | None = None


class Streams:
    """How far each stream of blocks has come."""

    def __init__(self) -> None:
        self._of_boot: dict[tuple[str, int], list[_Stream]] = {}
        self._known: dict[tuple[str, int, tuple[str, ...]], _Stream] = {}

    def next_seq(self, block: Block) -> int | None:
        """The number that comes next in the block's stream; None if it begins there."""
        return self._stream(block).next_seq

    def note(self, block: Block) -> None:
        """Take it that the block is there."""
        self._stream(block).next_seq = block.seq + len(block)

    def fresh(self, block: B) -> B | None:
        """What of a block is new, which is noted; None if it is all there already."""
        part = unseen(block, self.next_seq(block))
        if part is not None:
            self.note(part)
        return part

    def are_one(self, first: Block, second: Block) -> bool:
        """Whether two blocks are of one stream."""
        return self._stream(first) is self._stream(second)

    def _stream(self, block: Block) -> _Stream:
        names = () if isinstance(block, SampleBlock) else _names(block)
        key = (block.device, block.boot, names)
        if (known := self._known.get(key)) is not None:
            return known
        beside = self._of_boot.setdefault(key[:2], [])
        found = next((one for one in beside if not one.names.isdisjoint(names)), None)
        if found is None:
            found = _Stream()
            beside.append(found)
        found.names.update(names)
        self._known[key] = found
        return found


def _names(block: EstimateBlock) -> tuple[str, ...]:
    columns = block.columns
    if isinstance(columns, ColumnTable):
        return tuple([name for name, _ in columns.names])
    return tuple([column.name for column in columns])


def owned(block: B) -> B:
    """A copy of the block with aligned and writable arrays."""
    columns = columns_of(block)
    # One array for all values: an array for each costs more than the copy.
    values = np.array([column.values for column in columns])
    copies = tuple(
        Column(column.name, column.unit, row, column.quality.copy())
        for column, row in zip(columns, values, strict=True)
    )
    t_ns = block.t_ns.copy()
    if isinstance(block, SampleBlock):
        device_us = block.device_us.copy()
        return SampleBlock(block.device, block.boot, block.seq, device_us, t_ns, copies)
    return EstimateBlock(block.device, block.boot, block.seq, t_ns, copies)
