"""Message counts per topic from the summary of a closed segment, without reading its data.

    footer     := 0x02 | 20 u64 | summary start u64 | offsets start u64 | summary CRC-32 u32 | magic
    summary    := records, among them channels and one statistics record
    statistics := … | size u32 | (channel u16, messages u64)*

A segment that is not closed, or whose summary has a wrong checksum, gives no counts.
"""

import os
import struct
import zlib
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.records import Channel

from rigwatch.wire.session.chunks import MAGIC

_RECORD = struct.Struct("<BQ")
_FOOTER = struct.Struct("<BQQQI")
_COUNT = struct.Struct("<HQ")
_FOOTER_KIND, _CHANNEL, _STATISTICS = 0x02, 0x04, 0x0B
_COUNTS_AT = 42
"""Offset of the counts by channel in a statistics record."""


def topic_counts(path: Path) -> dict[str, int] | None:
    """Messages by topic, None if unknown."""
    try:
        summary = _summary(path)
        return None if summary is None else _counts(summary)
    except (OSError, struct.error, EOFError, UnicodeDecodeError):
        return None


def _summary(path: Path) -> bytes | None:
    """The verified bytes of the summary, without the footer."""
    tail = _FOOTER.size + len(MAGIC)
    with path.open("rb") as file:
        end = file.seek(0, os.SEEK_END) - tail
        file.seek(max(end, 0))
        footer = file.read(tail)
        kind, length, start, _, crc = _FOOTER.unpack_from(footer)
        if kind != _FOOTER_KIND or length != 20 or not footer.endswith(MAGIC) or start > end:
            return None
        file.seek(start)
        summary = file.read(end - start)
    checked = zlib.crc32(footer[: _FOOTER.size - 4], zlib.crc32(summary))
    return summary if start and crc == checked else None


def _counts(summary: bytes) -> dict[str, int] | None:
    topics: dict[int, str] = {}
    counts: dict[int, int] | None = None
    at = 0
    while at + _RECORD.size <= len(summary):
        kind, length = _RECORD.unpack_from(summary, at)
        at += _RECORD.size
        if kind == _CHANNEL:
            channel = Channel.read(ReadDataStream(BytesIO(summary[at : at + length])))
            topics[channel.id] = channel.topic
        elif kind == _STATISTICS:
            pairs = summary[at + _COUNTS_AT + 4 : at + length]
            counts = dict(_COUNT.iter_unpack(pairs))
        at += length
    if counts is None or not counts.keys() <= topics.keys():
        return None
    found: dict[str, int] = {}
    for number, count in counts.items():
        found[topics[number]] = found.get(topics[number], 0) + count
    return found
