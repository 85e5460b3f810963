"""The chunks of a closed file that hold messages of one topic; others are not unpacked.

    ┌ read, counted into the checksum ┬ read, counted, unpacked, checked ┬ read, counted ┬ …
    │ estimates                       │ samples                          │ estimates     │

No byte goes unchecked: those passed over count into the checksum of all data at the file's end.
"""

import zlib
from collections.abc import Iterator, Set
from pathlib import Path
from typing import BinaryIO

import zstandard

from rigwatch.wire.errors import SessionError, reason_of
from rigwatch.wire.session.chunks import CHUNK, RECORD, Chunk, Damage, DamagedError, unpacked
from rigwatch.wire.session.file_index import FileIndex

_STEP = 1 << 18


def selected_chunks(path: Path, index: FileIndex, others: Set[int]) -> Iterator[Chunk | Damage]:
    """The wanted chunks that are intact, in order, and a `Damage` for each that is not.

    Chunks whose messages are all of the channels `others` are not wanted.

    The last item is a `Damage` if any byte of the file's data differs from what was written; it
    spans them all, as one checksum cannot tell where.

    Raises:
        SessionError: the file cannot be read.
    """
    try:
        with path.open("rb", buffering=0) as file:
            yield from _selected(_Through(file, index.data_end), index, others)
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {reason_of(error)}") from error


class _Through:
    """Reads the first `size` bytes of a file once, and counts them all into one checksum."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._size = file, size
        self._window, self._at = b"", 0
        self._read = self.crc = 0

    def span(self, begin: int, end: int) -> bytes:
        """The bytes from `begin` to `end`, fewer if the file has ended; none before come later."""
        while self._read < end:
            step = max(_STEP, end - self._read) if begin < self._read else _STEP
            more = self._file.read(min(step, self._size - self._read))
            if not more:
                break
            self.crc = zlib.crc32(more, self.crc)
            kept = self._window[begin - self._at :] if begin < self._read else b""
            self._window, self._at = kept + more, self._read - len(kept)
            self._read += len(more)
        return self._window[begin - self._at : end - self._at]


def _selected(through: _Through, index: FileIndex, others: Set[int]) -> Iterator[Chunk | Damage]:
    unpacker = zstandard.ZstdDecompressor()
    for begin, end in index.without(others):
        record = through.span(begin, end)
        try:
            yield Chunk(begin, _unpacked(record, end - begin, unpacker))
        except DamagedError as damage:
            yield Damage(begin, end - begin, str(damage))
    through.span(index.data_end, index.data_end)
    if through.crc != index.data_crc:
        yield Damage(0, index.data_end, "data of a wrong checksum")


def _unpacked(record: bytes, size: int, unpacker: zstandard.ZstdDecompressor) -> bytes:
    if record[: RECORD.size] != RECORD.pack(CHUNK, size - RECORD.size):
        raise DamagedError("a chunk with a damaged head")
    return unpacked(record[RECORD.size :], unpacker)
