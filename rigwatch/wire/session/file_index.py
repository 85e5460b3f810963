"""What a closed segment says of itself at its end: messages per topic, and where each chunk lies.

    data end    := 0x0F | 4 u64 | CRC-32 of every byte before it u32
    summary     := records, among them schemas, channels, one statistics record, chunk indexes
    footer      := 0x02 | 20 u64 | summary start u64 | u64 | summary CRC-32 u32 | magic
    statistics  := … | chunks u32 | … | size u32 | (channel u16, messages u64)*
    chunk index := start u64 | end u64 | offset u64 | length u64 | size u32
                   | (channel u16, offset u64)* | length of its message indexes u64 | …

A segment that is not closed, or whose summary has a wrong checksum, gives nothing.
"""

import os
import struct
import zlib
from collections.abc import Iterator, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Channel
from numpy.typing import NDArray

from rigwatch.wire.arrays import IntArray
from rigwatch.wire.session.chunk_reader import declaration
from rigwatch.wire.session.chunks import LARGEST_RECORD, MAGIC, RECORD

_FOOTER = struct.Struct("<BQQQI")
_DATA_END = struct.Struct("<BQI")
_COUNT = struct.Struct("<HQ")
_U32 = struct.Struct("<I")
_HEAD = np.dtype([("times", "V16"), ("begin", "<u8"), ("size", "<u8"), ("width", "<u4")])
"""The head of a chunk index."""
_SIZE, _NUMBER = np.dtype("<u8"), np.dtype("<u2")
_UNREADABLE = (OSError, struct.error, McapError, ValueError, IndexError)
Places = NDArray[np.intp]
_HEADER_KIND, _FOOTER_KIND, _SCHEMA, _CHANNEL = 0x01, 0x02, 0x03, 0x04
_CHUNK_INDEX, _STATISTICS, _DATA_END_KIND = 0x08, 0x0B, 0x0F
_CHUNKS_AT, _COUNTS_AT = 22, 42
"""Offsets of the number of chunks and of the counts by channel in a statistics record."""


@dataclass(frozen=True, slots=True)
class FileIndex:
    """The index of a segment that holds nothing but chunks, each before its message indexes.

    Attributes:
        declarations: kind and body of every schema and channel record.
        spans: where the record of each chunk begins and ends in the file, in order, shape (k, 2).
        channel: the channel of a chunk's messages, -1 if it is not one alone, shape (k,).
        several: the channels of those with several or none, by their row.
        data_end: size of all before the end of data [bytes].
        data_crc: its checksum.
    """

    declarations: tuple[tuple[int, bytes], ...]
    spans: IntArray
    channel: IntArray
    several: dict[int, frozenset[int]]
    data_end: int
    data_crc: int

    def without(self, others: Set[int]) -> list[tuple[int, int]]:
        """Spans of the chunks that may hold messages of channels other than `others`."""
        wanted = ~np.isin(self.channel, list(others))
        for row, channels in self.several.items():
            wanted[row] = not channels or not channels <= others
        return [(begin, end) for begin, end in self.spans[wanted].tolist()]


def topic_counts(path: Path) -> dict[str, int] | None:
    """Messages by topic, None if unknown."""
    try:
        summary, _ = _summary(path)
        return _counts(summary)
    except _UNREADABLE:
        return None


def file_index(path: Path) -> FileIndex | None:
    """The index of a segment; None if it has none, or no checksum of all its data."""
    try:
        summary, start = _summary(path)
        return _file_index(path, summary, start)
    except _UNREADABLE:
        return None


def _summary(path: Path) -> tuple[bytes, int]:
    """The verified bytes of the summary, without the footer, and where it starts.

    Raises:
        ValueError: the file is not closed, or the checksum is wrong.
    """
    tail = _FOOTER.size + len(MAGIC)
    with path.open("rb") as file:
        end = file.seek(0, os.SEEK_END) - tail
        file.seek(max(end, 0))
        footer = file.read(tail)
        kind, length, start, _, crc = _FOOTER.unpack_from(footer)
        if kind != _FOOTER_KIND or length != 20 or not footer.endswith(MAGIC) or start > end:
            raise ValueError("not closed")
        file.seek(start)
        summary = file.read(end - start)
    checked = zlib.crc32(footer[: _FOOTER.size - 4], zlib.crc32(summary))
    if not start or crc != checked:
        raise ValueError("a summary with a wrong checksum")
    return summary, start


def _records(summary: bytes) -> Iterator[tuple[int, int, int]]:
    """Kind, begin and end of the body of each record."""
    at = 0
    while at + RECORD.size <= len(summary):
        kind, length = RECORD.unpack_from(summary, at)
        at += RECORD.size
        yield kind, at, at + length
        at += length


def _counts(summary: bytes) -> dict[str, int] | None:
    topics: dict[int, str] = {}
    counts: dict[int, int] | None = None
    for kind, begin, end in _records(summary):
        if kind == _CHANNEL:
            channel = declaration(kind, summary[begin:end])
            if isinstance(channel, Channel):
                topics[channel.id] = channel.topic
        elif kind == _STATISTICS:
            counts = dict(_COUNT.iter_unpack(summary[begin + _COUNTS_AT + 4 : end]))
        if counts is not None and counts.keys() <= topics.keys():
            return _by_topic(counts, topics)
    return None


def _by_topic(counts: dict[int, int], topics: dict[int, str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for number, count in counts.items():
        found[topics[number]] = found.get(topics[number], 0) + count
    return found


def _file_index(path: Path, summary: bytes, start: int) -> FileIndex | None:
    first, crc = _ends(path, start)
    declarations: list[tuple[int, bytes]] = []
    places: list[int] = []
    counted = 0
    for kind, begin, end in _records(summary):
        if kind == _CHUNK_INDEX:
            places.append(begin)
        elif kind in (_SCHEMA, _CHANNEL):
            declarations.append((kind, summary[begin:end]))
        elif kind == _STATISTICS:
            (counted,) = _U32.unpack_from(summary, begin + _CHUNKS_AT)
    if not crc or not places or len(places) != counted:
        return None
    data_end = start - _DATA_END.size
    at = np.array(places)
    heads = _gathered(summary, at, _HEAD)
    spans = _spans(summary, at, heads, first, data_end)
    if spans is None:
        return None
    channel, several = _channels(summary, at, heads["width"])
    return FileIndex(tuple(declarations), spans, channel, several, data_end, crc)


def _ends(path: Path, start: int) -> tuple[int, int]:
    """Where the header ends, and the checksum of the data before a summary at `start`."""
    with path.open("rb") as file:
        kind, length = RECORD.unpack(file.read(len(MAGIC) + RECORD.size)[len(MAGIC) :])
        file.seek(start - _DATA_END.size)
        last, size, crc = _DATA_END.unpack(file.read(_DATA_END.size))
    if kind != _HEADER_KIND or (last, size) != (_DATA_END_KIND, 4):
        raise ValueError("not the ends of data")
    return len(MAGIC) + RECORD.size + length, crc


def _spans(
    summary: bytes, places: Places, heads: NDArray[Any], first: int, last: int
) -> IntArray | None:
    """Where chunks lie whose indexes have their bodies at `places`; None if they do not fill the
    file from `first` to `last` with the message indexes behind them."""
    behind = _gathered(summary, places + _HEAD.itemsize + heads["width"], _SIZE)
    if max(heads["size"].max(), behind.max()) > LARGEST_RECORD:
        return None
    # Where anything else lies between chunks, only a search finds what it is.
    ends = heads["begin"] + heads["size"]
    follows = np.append(heads["begin"], np.uint64(last))
    if follows[0] != first or (ends + behind != follows[1:]).any():
        return None
    return np.stack([heads["begin"], ends], axis=1).astype(np.int64)


def _channels(
    summary: bytes, places: Places, width: NDArray[Any]
) -> tuple[IntArray, dict[int, frozenset[int]]]:
    """The channel of each chunk, and of those that have several or none, all."""
    channel = _gathered(summary, places + _HEAD.itemsize, _NUMBER).astype(np.int64)
    several: dict[int, frozenset[int]] = {}
    for row in np.flatnonzero(width != _COUNT.size).tolist():
        at = int(places[row]) + _HEAD.itemsize
        pairs = _COUNT.iter_unpack(summary[at : at + int(width[row])])
        channel[row], several[row] = -1, frozenset(number for number, _ in pairs)
    return channel, several


def _gathered(data: bytes, places: Places, kind: np.dtype[Any]) -> NDArray[Any]:
    """The values of a `kind` at the places."""
    rows = np.frombuffer(data, np.uint8)[places[:, None] + np.arange(kind.itemsize)]
    found: NDArray[Any] = rows.view(kind)[:, 0]
    return found
