"""Writes blocks of samples and estimates as protobuf bytes straight from their arrays.

The bytes are those of `protobuf.encode`, which makes a Python object of every number. What this
module does not recognise is left to it.
"""

import struct
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.messages import protobuf_schema as schema
from rigwatch.wire.messages.blocks import Block
from rigwatch.wire.messages.message_types import (
    Column,
    ColumnTable,
    EstimateBlock,
    Names,
    SampleBlock,
)
from rigwatch.wire.messages.protobuf import encode

_TAGS = {
    kind: tuple([bytes([tag]) for tag in schema.field_tags(kind).values()])
    for kind in (Column, SampleBlock, EstimateBlock)
}
_NAME, _UNIT, _VALUES, _QUALITY = _TAGS[Column]
_FLOAT, _INT, _BYTE = np.dtype("<f8"), np.dtype("<i8"), np.dtype("u1")
_LARGEST = 1 << 63
LENGTHS_KEPT = 512
"""Columns and lengths whose heads are kept: a live block has few lengths, a recorded one any, and
ten times as many would take 2 MB before they serve again."""
TABLES_KEPT = 64
"""The same of whole tables."""


def encode_block(block: Block) -> bytes:
    """Encode a block as protobuf bytes."""
    samples = isinstance(block, SampleBlock)
    columns = block.channels if isinstance(block, SampleBlock) else block.columns
    times = [block.device_us, block.t_ns] if isinstance(block, SampleBlock) else [block.t_ns]
    if not _is_plain(block, times, columns):
        return encode(block)
    _, _, seq, *places = _TAGS[type(block)]
    parts = [
        _source(samples, block.device).head(int(block.boot)),
        _number(seq, int(block.seq)),
        *(_part(tag, one.tobytes()) for tag, one in zip(places[: 1 + samples], times, strict=True)),
    ]
    if isinstance(columns, ColumnTable):
        parts += _rows(places[-1], columns)
    else:
        parts += [_column(places[-1], column) for column in columns]
    return b"".join(parts)


def source_bytes(kind: type[Block], device: str, boot: int) -> bytes:
    """What all blocks of a boot begin with."""
    return _source(kind is SampleBlock, device).head(boot)


def estimate_heads(names: Names, size: int) -> tuple[bytes, tuple[bytes, ...]]:
    """What precedes the times, and each column's values, of estimates without quality.

    Args:
        names: of the columns.
        size: of the times, and of each column's values [bytes].
    """
    *_, times, columns = estimate_tags()
    return _head(times, size), _heads(columns, names, size)


def estimate_tags() -> tuple[bytes, ...]:
    """What marks device, boot, number, times and each column of a block of estimates."""
    return _TAGS[EstimateBlock]


class _Source:
    """The bytes that all blocks of a boot begin with, of a device's newest boot: a year has
    hundreds.
    """

    def __init__(self, samples: bool, device: str) -> None:
        device_tag, self._boot_tag, *_ = _TAGS[SampleBlock if samples else EstimateBlock]
        self._device = _part(device_tag, device.encode())
        self._newest: tuple[int | None, bytes] = None, b""

    def head(self, boot: int) -> bytes:
        """Those of a boot."""
        newest, head = self._newest
        if newest != boot:
            head = self._device + _number(self._boot_tag, boot)
            self._newest = boot, head
        return head


@lru_cache(maxsize=LENGTHS_KEPT)
def _source(samples: bool, device: str) -> _Source:
    return _Source(samples, device)


def _is_plain(block: Block, times: list[NDArray[np.int64]], columns: Sequence[Column]) -> bool:
    if isinstance(columns, ColumnTable):
        numbers = columns.values.dtype == _FLOAT
    else:
        numbers = all(c.values.dtype == _FLOAT and c.quality.dtype == _BYTE for c in columns)
    return (
        numbers
        and all(-_LARGEST <= number < _LARGEST for number in (block.boot, block.seq))
        and all(one.dtype == _INT for one in times)
    )


def _rows(tag: bytes, table: ColumnTable) -> list[bytes]:
    """The bytes of each column's head and of its values."""
    size = table.values.itemsize * table.values.shape[1]
    heads = _heads(tag, table.names, size)
    parts = [b""] * (2 * len(heads))
    parts[::2] = heads
    parts[1::2] = _cutter(len(heads), size).unpack(table.values.tobytes())
    return parts


@lru_cache(maxsize=TABLES_KEPT)
def _cutter(count: int, size: int) -> struct.Struct:
    """Cuts the bytes of a table into those of its columns; a slice for each costs more."""
    return struct.Struct(f"{size}s" * count)


@lru_cache(maxsize=TABLES_KEPT)
def _heads(tag: bytes, names: Names, size: int) -> tuple[bytes, ...]:
    """The bytes before the values of each column."""
    return tuple(_around(tag, name, unit, size, 0)[0] for name, unit in names)


def _column(tag: bytes, column: Column) -> bytes:
    values, quality = column.values.tobytes(), column.quality.tobytes()
    head, middle = _around(tag, column.name, column.unit, len(values), len(quality))
    return head + values + middle + quality


@lru_cache(maxsize=LENGTHS_KEPT)
def _around(tag: bytes, name: str, unit: str, values: int, quality: int) -> tuple[bytes, bytes]:
    """The bytes before a column's values, and those between its values and its quality."""
    first = _part(_NAME, name.encode()) + _part(_UNIT, unit.encode()) + _head(_VALUES, values)
    middle = _head(_QUALITY, quality)
    return tag + _varint(len(first) + values + len(middle) + quality) + first, middle


def _head(tag: bytes, size: int) -> bytes:
    """What precedes a field of so many bytes; nothing if it is empty."""
    return tag + _varint(size) if size else b""


def _part(tag: bytes, data: bytes) -> bytes:
    """A field of bytes; nothing if it is empty."""
    return _head(tag, len(data)) + data


def _number(tag: bytes, value: int) -> bytes:
    """A signed number; nothing for 0."""
    return tag + _varint((value << 1) ^ (value >> 63)) if value else b""


def _varint(value: int) -> bytes:
    if value < 0x80:
        return bytes((value,))
    found = bytearray()
    while value >= 0x80:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    return bytes(found)
