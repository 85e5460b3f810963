"""Reads blocks of samples and estimates straight from their protobuf bytes, as numpy arrays.

The general decoder makes a Python object of every number; here the packed doubles and integers are
taken over as they lie. Whatever this module does not recognise is left to `schema.decode`, which
says what is wrong.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from rigwatch.wire import schema
from rigwatch.wire.messages import ByteArray, Column, EstimateBlock, SampleBlock

_NO_QUALITY: ByteArray = np.zeros(0, np.uint8)
_F8, _I8, _U1 = np.dtype("<f8"), np.dtype("<i8"), np.dtype("u1")
_LENGTH_DELIMITED, _VARINT = 2, 0
K = TypeVar("K", SampleBlock, EstimateBlock)


class _UnfamiliarError(Exception):
    """An encoding that this module leaves to the general decoder."""


def decode_block(kind: type[K], data: bytes) -> K:
    """The block that `data` holds; its arrays may be unaligned views of `data`.

    Raises:
        MessageError: the bytes are no such message, or its columns differ in length.
    """
    try:
        block: K = _PARSERS[kind](data)
        _check(block)
    except (_UnfamiliarError, IndexError, ValueError):
        return schema.decode(kind, data)
    return block


def _check(block: SampleBlock | EstimateBlock) -> None:
    n = len(block)
    columns = block.channels if isinstance(block, SampleBlock) else block.columns
    for column in columns:
        if len(column.values) != n or len(column.quality) not in (0, n):
            raise _UnfamiliarError
    if isinstance(block, SampleBlock) and len(block.device_us) != n:
        raise _UnfamiliarError


def _varint(data: bytes, at: int) -> tuple[int, int]:
    if data[at + 1] < 0x80:
        return (data[at] & 0x7F) | (data[at + 1] << 7), at + 2
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
        if shift > 63:
            raise _UnfamiliarError


def _fields(data: bytes, at: int, end: int) -> dict[int, Any]:
    """Fields of the message in data[at:end]: int for a varint, (start, stop) for bytes.

    Repeated ones are lists of them; field 6 and above only occur as columns.
    """
    found: dict[int, Any] = {}
    while at < end:
        tag, value, after = data[at], data[at + 1], at + 2
        if value >= 0x80:
            value, after = _varint(data, at + 1)
        if tag & 7 == _LENGTH_DELIMITED:
            at = after + value
            found.setdefault(tag >> 3, []).append((after, at))
        elif tag & 7 == _VARINT and tag < 0x80:
            at = after
            found[tag >> 3] = (value >> 1) ^ -(value & 1)
        else:
            raise _UnfamiliarError
    if at != end:
        raise _UnfamiliarError
    return found


@lru_cache(maxsize=512)
def _text(data: bytes) -> str:
    return data.decode()


def _string(data: bytes, spans: list[tuple[int, int]] | None) -> str:
    if spans is None:
        return ""
    ((start, stop),) = spans
    return _text(data[start:stop])


def _array(data: bytes, spans: list[tuple[int, int]] | None, dtype: "np.dtype[Any]") -> Any:
    if spans is None:
        return np.zeros(0, dtype)
    ((start, stop),) = spans
    count, rest = divmod(stop - start, dtype.itemsize)
    if rest:
        raise _UnfamiliarError
    return np.frombuffer(data, dtype, count, start)


def _column(data: bytes, span: tuple[int, int]) -> Column:
    fields = _fields(data, *span)
    quality = _array(data, fields[4], _U1) if 4 in fields else _NO_QUALITY
    name, unit = _string(data, fields.get(1)), _string(data, fields.get(2))
    return Column(name, unit, _array(data, fields.get(3), _F8), quality)


def _samples(data: bytes) -> SampleBlock:
    get = _fields(data, 0, len(data)).get
    return SampleBlock(
        _string(data, get(1)),
        get(2, 0),
        get(3, 0),
        _array(data, get(4), _I8),
        _array(data, get(5), _I8),
        tuple([_column(data, span) for span in get(6, ())]),
    )


def _estimates(data: bytes) -> EstimateBlock:
    get = _fields(data, 0, len(data)).get
    return EstimateBlock(
        _string(data, get(1)),
        get(2, 0),
        get(3, 0),
        _array(data, get(4), _I8),
        tuple([_column(data, span) for span in get(5, ())]),
    )


_PARSERS: dict[Any, Callable[[bytes], Any]] = {SampleBlock: _samples, EstimateBlock: _estimates}
