"""Reads blocks of samples and estimates straight from their protobuf bytes, as numpy arrays.

The general decoder makes a Python object of every number; here the packed doubles and integers are
viewed in place. Blocks of devices that measure the same differ only in the device's name, `boot`,
`seq` and the numbers, so their layout is determined once, and every other byte is compared for each
further block. Anything that this module does not recognise is left to `protobuf.decode`, which
reports the error.
"""

import sys
from collections.abc import Set
from typing import Any, TypeVar

import numpy as np

from rigwatch.wire.messages import protobuf_schema as schema
from rigwatch.wire.messages.layout import (
    ColumnPlace,
    Layout,
    Span,
    UnfamiliarError,
    filling,
    varint,
)
from rigwatch.wire.messages.message_types import ByteArray, Column, EstimateBlock, SampleBlock
from rigwatch.wire.messages.protobuf import decode
from rigwatch.wire.messages.recent import Recent

NO_QUALITY: ByteArray = np.zeros(0, np.uint8)
_F8, _I8, _U1 = np.dtype("<f8"), np.dtype("<i8"), np.dtype("u1")
LARGEST_GATHERED = 1 << 13
"""Largest block whose offsets are needed one by one [bytes]."""
MOST_LAYOUTS, LAYOUTS_ROOM = 48, 1 << 16
"""Layouts kept in a generation, and the sum of their blocks' sizes [bytes].

A live block has few lengths, but a busy machine makes some that hardly come again, and offsets take
the memory of a block. Little room is full within minutes; much of it fills for a year.
"""
_TAGS = {kind: schema.field_tags(kind) for kind in (SampleBlock, EstimateBlock)}
_DEVICE, _BOOT, _SEQ = (_TAGS[SampleBlock][name] for name in ("device", "boot", "seq"))
_TIMES = {
    SampleBlock: (_TAGS[SampleBlock]["device_us"], _TAGS[SampleBlock]["t_ns"]),
    EstimateBlock: (_TAGS[EstimateBlock]["t_ns"],),
}
_COLUMNS = {
    SampleBlock: _TAGS[SampleBlock]["channels"],
    EstimateBlock: _TAGS[EstimateBlock]["columns"],
}
_NAME, _UNIT, _VALUES, _QUALITY = schema.field_tags(Column).values()
K = TypeVar("K", SampleBlock, EstimateBlock)
UNFAMILIAR = (UnfamiliarError, IndexError, ValueError)
"""What an encoding raises that is left to the general decoder."""
_layouts: Recent[tuple[type[Any], int, int], Layout] = Recent(MOST_LAYOUTS, LAYOUTS_ROOM)


def keep_layouts(most: int, room: int) -> None:
    """Keep this many layouts in a generation, with this sum of their blocks' sizes [bytes]."""
    _layouts.grow(most, room)


def decode_block(kind: type[K], data: bytes) -> K:
    """Decode a block; its arrays may be unaligned views of `data`.

    Raises:
        MessageError: the bytes are not such a message, or its columns differ in length.
    """
    try:
        return _read(kind, layout_of(kind, data), data)
    except UNFAMILIAR:
        return decode(kind, data)


def layout_of(kind: type[Any], data: bytes) -> Layout:
    """The layout of `data`, computed unless an earlier block has the same.

    Raises:
        one of UNFAMILIAR: the general decoder has to read it.
    """
    key = kind, len(data), data[1]  # usually the length of the device's name
    known = _layouts.get(key)
    if known is not None and _fits(known, data):
        return known
    layout = _layout(kind, data)
    _layouts.put(key, layout, min(len(data), LARGEST_GATHERED))
    return layout


def known_layout(kind: type[Any], data: bytes) -> Layout | None:
    """The layout that `data` has, if it is one that an earlier block had: not compared yet."""
    return _layouts.get((kind, len(data), data[1])) if len(data) > 1 else None


def _fits(layout: Layout, data: bytes) -> bool:
    for span in (layout.boot, layout.seq):
        if span is not None and filling(data[span[0] : span[1]]) is None:
            return False
    return layout.reader.unpack(data) == layout.parts


def _read(kind: type[K], layout: Layout, data: bytes) -> K:
    n, read = layout.samples, np.frombuffer
    columns = tuple(
        [
            Column(
                place.name,
                place.unit,
                read(data, _F8, n, place.values),
                NO_QUALITY if place.quality < 0 else read(data, _U1, n, place.quality),
            )
            for place in layout.columns
        ]
    )
    times = [read(data, _I8, n, start) for start in layout.times]
    return kind(*layout.head(data), *times, columns)  # type: ignore[call-arg, arg-type]


def _layout(kind: type[Any], data: bytes) -> Layout:
    """The layout of `data`, with lengths checked."""
    fields = _fields(data, (0, len(data)), {_DEVICE, _BOOT, _SEQ, *_TIMES[kind], _COLUMNS[kind]})
    times = [_only(fields.get(tag)) for tag in _TIMES[kind]]
    n, rest = divmod(times[0][1] - times[0][0], _I8.itemsize)
    if rest or any(stop - start != n * _I8.itemsize for start, stop in times):
        raise UnfamiliarError
    columns = [_column(data, span, n) for span in fields.get(_COLUMNS[kind], ())]
    boot, seq = (_only(fields[tag]) if tag in fields else None for tag in (_BOOT, _SEQ))
    device = _only(fields[_DEVICE]) if _DEVICE in fields else None
    variable = [span for span in (device, boot, seq) if span]
    variable += times + [(place.values, place.values + n * _F8.itemsize) for place in columns]
    variable += [(place.quality, place.quality + n) for place in columns if place.quality >= 0]
    return Layout(
        n,
        device,
        boot,
        seq,
        tuple(start for start, _ in times),
        tuple(columns),
        *_between(data, sorted(variable)),
    )


def _column(data: bytes, span: Span, n: int) -> ColumnPlace:
    fields = _fields(data, span, {_NAME, _UNIT, _VALUES, _QUALITY})
    values = _only(fields.get(_VALUES))
    quality = _only(fields[_QUALITY]) if _QUALITY in fields else (-1, n - 1)
    if values[1] - values[0] != n * _F8.itemsize or quality[1] - quality[0] != n:
        raise UnfamiliarError
    # Layouts share their names.
    name, unit = (sys.intern(_text(data, fields.get(tag))) for tag in (_NAME, _UNIT))
    return ColumnPlace(name, unit, values[0], quality[0])


def _between(data: bytes, variable: list[Span]) -> tuple[tuple[bytes, ...], tuple[int, ...]]:
    """The parts of `data` around these spans, and where each begins."""
    starts = (0, *(stop for _, stop in variable))
    stops = (*(start for start, _ in variable), len(data))
    return tuple(data[a:b] for a, b in zip(starts, stops, strict=True)), starts


def _fields(data: bytes, within: Span, tags: Set[int]) -> dict[int, list[Span]]:
    """Offsets of the fields of the message at `within`, by tag; it has no others."""
    at, end = within
    found: dict[int, list[Span]] = {}
    while at < end:
        tag = data[at]
        value, after = varint(data, at + 1)
        if tag not in tags:
            raise UnfamiliarError
        span = (at + 1, after) if tag in (_BOOT, _SEQ) else (after, after + value)
        found.setdefault(tag, []).append(span)
        at = span[1]
    if at != end:
        raise UnfamiliarError
    return found


def _only(spans: list[Span] | None) -> Span:
    if spans is None or len(spans) != 1:
        raise UnfamiliarError
    return spans[0]


def _text(data: bytes, spans: list[Span] | None) -> str:
    return "" if spans is None else data[slice(*_only(spans))].decode()
