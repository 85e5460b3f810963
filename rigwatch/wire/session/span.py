"""A span of time of several segments, read page by page without what lies before it.

Chunks carry the times of their messages, so those of other times are skipped without being
unpacked. A page ends at a `Place`, from which the next one continues.
"""

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

import zstandard

from rigwatch.wire.errors import MessageError, SessionError, reason_of
from rigwatch.wire.messages import (
    EstimateBlock,
    SampleBlock,
    Topic,
    blocks,
    decode,
    decode_block,
    encode,
)
from rigwatch.wire.session.chunk_reader import ChunkReader
from rigwatch.wire.session.chunks import (
    CHUNK,
    MAGIC,
    RECORD,
    Chunk,
    DamagedError,
    next_chunk,
    unpacked,
)
from rigwatch.wire.session.writer import message_time

_TIMES = struct.Struct("<QQ")
LONGEST_BLOCK_NS = 60_000_000_000
"""A block that began earlier than this before a span holds no sample of it [ns]."""
Part = tuple[Topic, bytes]
"""A topic and the bytes of a message."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a page ends: segment, offset of a chunk, number of its messages already read."""

    segment: int = 0
    offset: int = 0
    parts: int = 0


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which messages are read.

    Attributes:
        topics: of these topics.
        start, end: with times in [start, end), and the samples of that time [ns].
        size: bytes of a page, above which it ends.
    """

    topics: frozenset[Topic]
    start: int
    end: int
    size: int


def read_page(
    segments: Sequence[Path],
    wanted: Wanted,
    place: Place,
    enough: Callable[[], bool] = lambda: False,
) -> tuple[list[Part], Place | None]:
    """The next messages from `place` on, in recorded order, and where the next page begins.

    Args:
        segments: in the order of their recording.
        wanted: which messages.
        place: `Place()` for the first page.
        enough: whether the page shall end with the chunk that has been read, however little it had.

    Returns:
        The messages, cut into parts small enough for a page, and None at the end.
    """
    found: list[Part] = []
    size = 0
    for here, parts in _chunks(segments, wanted, place):
        if here != place and enough():
            return found, here
        for index, part in parts:
            if size + len(part[1]) > wanted.size and found:
                return found, Place(here.segment, here.offset, index)
            found.append(part)
            size += len(part[1])
    return found, None


def _chunks(
    segments: Sequence[Path], wanted: Wanted, place: Place
) -> Iterator[tuple[Place, Iterator[tuple[int, Part]]]]:
    """The place of each chunk, and the number and content of its parts from `place` on."""
    for number in range(place.segment, len(segments)):
        begin = place if number == place.segment else Place(number)
        reader = ChunkReader(segments[number], set())
        for chunk in chunks_between(segments[number], begin.offset, wanted.start, wanted.end):
            done = begin.parts if chunk.offset == begin.offset else 0
            parts = enumerate(_of_chunk(reader, chunk, wanted))
            yield Place(number, chunk.offset, done), islice(parts, done, None)


def _of_chunk(reader: ChunkReader, chunk: Chunk, wanted: Wanted) -> Iterator[Part]:
    for line, _, data in reader.messages(chunk.records):
        if line not in wanted.topics:
            continue
        try:
            if line.message in (SampleBlock, EstimateBlock):
                yield from ((line, part) for part in _cut(line, data, wanted))
            elif wanted.start <= message_time(decode(line.message, data)) < wanted.end:
                yield line, data
        except MessageError:
            continue


def _cut(line: Topic, data: bytes, wanted: Wanted) -> Iterator[bytes]:
    """The samples of a block that lie in the span, in pieces that fit into a page."""
    whole: Any = decode_block(line.message, data)  # type: ignore[type-var]
    block: Any = blocks.between(whole, wanted.start, wanted.end)
    if block is None:
        return
    if block is whole and len(data) <= wanted.size:
        yield data
        return
    samples = max(1, wanted.size * len(whole) // len(data))
    yield from map(encode, blocks.pieces(block, samples))


def chunks_between(path: Path, offset: int, start: int, end: int) -> Iterator[Chunk]:
    """The intact chunks of a file from `offset` on that may hold messages of [start, end) [ns].

    Raises:
        SessionError: the file cannot be read.
    """
    try:
        with path.open("rb") as file:
            size = path.stat().st_size
            yield from _walk(file, max(offset, len(MAGIC)), size, (start, end))
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {reason_of(error)}") from error


def _walk(file: BinaryIO, at: int, size: int, span: tuple[int, int]) -> Iterator[Chunk]:
    unpacker = zstandard.ZstdDecompressor()
    while at + RECORD.size < size:
        file.seek(at)
        head = file.read(RECORD.size + _TIMES.size)
        kind, length = RECORD.unpack_from(head)
        after = at + RECORD.size + length
        if after > size:
            # Still being written, or the recorder was killed there.
            after = next_chunk(file, at + 1, size)
        elif kind == CHUNK and length > _TIMES.size and _overlaps(head, span):
            file.seek(at + RECORD.size)
            try:
                yield Chunk(at, unpacked(file.read(length), unpacker))
            except DamagedError:
                after = next_chunk(file, at + 1, size)
        at = after


def _overlaps(head: bytes, span: tuple[int, int]) -> bool:
    first, last = _TIMES.unpack_from(head, RECORD.size)
    return bool(last >= span[0] - LONGEST_BLOCK_NS and first < span[1])
