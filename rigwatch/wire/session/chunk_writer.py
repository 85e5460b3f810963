"""The MCAP library's writer, with each chunk put together at once and the index kept as bytes.

The library writes a chunk and its indexes number by number, makes a compressor for each, and keeps
an object of 640 bytes for each until the file is closed; a recorder writes up to five chunks a
second and rig. The bytes are those of the library. One of another shape is used as it is.
"""

import struct
import threading
import zlib
from collections.abc import Iterator
from itertools import chain
from typing import Any, Self

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.writer import CompressionType, Writer

from rigwatch.wire.session.chunks import CHUNK, RECORD

_NEVER = 1 << 62
_MESSAGE_INDEX, _CHUNK_INDEX = 0x07, 0x08
_CHUNK = struct.Struct("<QQQII4sQ")
_MESSAGES = struct.Struct("<HI")
_PLACE = struct.Struct("<HQ")
_PLACES, _SIZES = struct.Struct("<QQQQI"), struct.Struct("<QI4sQQ")
_NAME = b"zstd"
_NAMES = ("chunk_builder", "chunk_indices", "data_section_crc", "flush", "statistics", "stream")
_compressor, _compressing = zstandard.ZstdCompressor(), threading.Lock()
SHARED = 1 << 15
"""Size of a chunk up to which all share a compressor, which saves most of its time [bytes].

It keeps room for the largest that it was given: 0.7 MB for one of this size, 1.5 MB for that of a
recorder that was held up once.
"""


def chunk_writer(output: Any) -> Writer:
    """A writer to `output` that ends chunks at each `flush`, and only then."""
    quick = ChunkWriter(output, _NEVER, CompressionType.ZSTD, enable_data_crcs=True)
    if all(hasattr(quick, f"_Writer__{name}") for name in _NAMES) and quick.indexes == []:
        quick.indexes = PackedIndex()
        return quick
    return Writer(output, _NEVER, CompressionType.ZSTD, enable_data_crcs=True)


class ChunkWriter(Writer):
    """One whose chunks are compressed by zstd, see `chunk_writer`."""

    @property
    def indexes(self) -> Any:
        """Indexes of the chunks so far."""
        return self._own._Writer__chunk_indices

    @indexes.setter
    def indexes(self, indexes: Any) -> None:
        self._own._Writer__chunk_indices = indexes

    @property
    def _own(self) -> Any:
        """This object with the attributes that the library's class calls its own."""
        return self

    def _Writer__finalize_chunk(self) -> None:  # noqa: N802 -- as the library calls it
        own, builder = self._own, self._own._Writer__chunk_builder
        if not builder.num_messages:
            return
        own._Writer__statistics.chunk_count += 1
        records = builder.end()
        packed = compressed(records)
        own._Writer__flush()
        span = builder.message_start_time, builder.message_end_time
        head = (len(records), zlib.crc32(records), len(_NAME), _NAME, len(packed))
        whole = _record(CHUNK, _CHUNK.pack(*span, *head), packed)
        start, size, places = own._Writer__stream.tell(), len(whole), b""
        for number, index in builder.message_indices.items():
            places += _PLACE.pack(number, start + len(whole))
            whole += _messages(number, index.records)
        own._Writer__data_section_crc = zlib.crc32(whole, own._Writer__data_section_crc)
        own._Writer__stream.write(whole)
        sizes = _SIZES.pack(len(whole) - size, len(_NAME), _NAME, len(packed), len(records))
        of = _PLACES.pack(*span, start, size, len(places))
        self.indexes.keep(_record(_CHUNK_INDEX, of, places, sizes))
        builder.reset()


def compressed(records: bytes) -> bytes:
    """The records of a chunk, compressed."""
    if len(records) > SHARED:
        return zstandard.ZstdCompressor().compress(records)
    with _compressing:
        return _compressor.compress(records)


def _record(kind: int, *parts: bytes) -> bytes:
    return b"".join((RECORD.pack(kind, sum(map(len, parts))), *parts))


def _messages(channel: int, records: list[tuple[int, int]]) -> bytes:
    """The index of a channel's messages in a chunk: time and offset of each."""
    entries = struct.pack(f"<{2 * len(records)}Q", *chain.from_iterable(records))
    return _record(_MESSAGE_INDEX, _MESSAGES.pack(channel, len(entries)), entries)


class PackedIndex:
    """Stands for the library's list of chunk indexes: the bytes that it will write at the end."""

    def __init__(self) -> None:
        self._records = bytearray()

    def keep(self, record: bytes) -> None:
        """Keep the record of a chunk."""
        self._records += record

    def __iter__(self) -> Iterator[Self]:
        yield self

    def write(self, stream: RecordBuilder) -> None:
        """Write all records at once."""
        stream.write(self._records)
