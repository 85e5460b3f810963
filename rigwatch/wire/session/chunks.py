"""Finds every intact chunk of an MCAP file, also in a truncated, overwritten or bit-flipped one.

    record  := opcode u8 | length u64 | body
    chunk   := start u64 | end u64 | raw size u64 | CRC-32 u32 | "zstd" | size u64 | compressed
    records

A chunk is valid only if its two lengths agree and the checksum of its unpacked bytes matches. If
not, the search continues at the next possible chunk, and the bytes in between are reported. Records
outside of chunks (indexes) are skipped, unless they may hide a chunk with a corrupted opcode.
"""

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import zstandard

from rigwatch.wire.errors import SessionError, reason_of

MAGIC = b"\x89MCAP0\r\n"
LARGEST_RECORD = 1 << 28
"""Far above the length of any valid record; a larger one is a flipped bit [bytes]."""
LARGEST_CHUNK = 1 << 26
"""The same for the unpacked records of a chunk, half a second of messages [bytes]."""
CHUNK, _MESSAGE, _MESSAGE_INDEX, _DATA_END, _FOOTER = 0x06, 0x05, 0x07, 0x0F, 0x02
_KNOWN = frozenset(range(0x01, 0x10))
RECORD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQII")
_U64 = struct.Struct("<Q")
_U32 = struct.Struct("<I")
_ZSTD = b"\x04\x00\x00\x00zstd"
_BEFORE_ZSTD = RECORD.size + _CHUNK_HEAD.size - 4
_STEP = 1 << 20


@dataclass(frozen=True, slots=True)
class Chunk:
    """The unpacked records of one intact chunk, and its offset in the file."""

    offset: int
    records: bytes


@dataclass(frozen=True, slots=True)
class Damage:
    """Unreadable bytes of a file: `size` from `offset` on, and the reason."""

    offset: int
    size: int
    reason: str


class DamagedError(Exception):
    """The defect of the current record."""


def magic_problem(head: bytes) -> str:
    """The defect of a file's first eight bytes, as text; empty for an MCAP file."""
    if head == MAGIC:
        return ""
    if not head:
        return "the file is empty, expected a session (MCAP)"
    return f"not an MCAP file (it begins with {head.hex(' ')})"


def _refuse_later_version(path: Path, head: bytes) -> None:
    if len(head) == len(MAGIC) and head[:5] + head[6:] == MAGIC[:5] + MAGIC[6:] and head != MAGIC:
        version = repr(chr(head[5]))
        raise SessionError(f"{path}: MCAP version {version}, this rigwatch reads version '0'")


def ends_closed(path: Path) -> bool:
    """Whether the file ends as a closed MCAP file does."""
    try:
        with path.open("rb") as file:
            file.seek(-len(MAGIC), os.SEEK_END)
            return file.read() == MAGIC
    except OSError:
        return False


def scan(path: Path) -> Iterator[Chunk | Damage]:
    """Every intact chunk of the file in order, and the damage between them.

    Raises:
        SessionError: the file cannot be opened, or is an MCAP file of another version.
    """
    try:
        with path.open("rb", buffering=_STEP) as file:
            head = file.read(len(MAGIC))
            _refuse_later_version(path, head)
            yield from _scan_records(file, head, path.stat().st_size)
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {reason_of(error)}") from error


def _scan_records(file: BinaryIO, magic: bytes, size: int) -> Iterator[Chunk | Damage]:
    offset = len(magic)
    if problem := magic_problem(magic):
        offset = next_chunk(file, 0, size)
        yield Damage(0, offset, problem)
        file.seek(offset)
    unpacker = zstandard.ZstdDecompressor()
    unread = offset
    while offset < size:
        head = file.read(RECORD.size)
        if head == MAGIC and offset + len(MAGIC) == size:
            return
        try:
            body = _body(file, head, size - offset)
            end = offset + RECORD.size + len(body)
            if head[0] == CHUNK:
                yield Chunk(offset, unpacked(body, unpacker))
                unread = end
            else:
                _check_other(head[0], body)
                if _ZSTD in body:
                    _check_length(file, offset, body, size)
            offset = end
        except DamagedError as damage:
            # No checksum protects what lies between chunks: a record there may end too late.
            unread = offset + 1 if head[0] == CHUNK else unread
            found = next_chunk(file, unread, size)
            start = offset if found > offset else unread
            yield Damage(start, found - start, str(damage))
            file.seek(found)
            offset = found


def _body(file: BinaryIO, head: bytes, left: int) -> bytes:
    if len(head) < RECORD.size:
        raise DamagedError("truncated")
    length = RECORD.unpack(head)[1]
    if length > left - RECORD.size:
        raise DamagedError("truncated, or a damaged length")
    if length > LARGEST_RECORD:
        raise DamagedError("a damaged length")
    return file.read(length)


def unpacked(body: bytes, unpacker: zstandard.ZstdDecompressor) -> bytes:
    """The unpacked, checked records of a chunk."""
    if not _is_chunk(body):
        raise DamagedError("a chunk whose lengths disagree, or not packed with zstd")
    _, _, raw_size, crc, _ = _CHUNK_HEAD.unpack_from(body)
    packed = memoryview(body)[_CHUNK_HEAD.size + 12 :]
    try:
        if raw_size > LARGEST_CHUNK or zstandard.frame_content_size(packed) != raw_size:
            raise DamagedError("a chunk of the wrong size")
        records = unpacker.decompress(packed)
    except zstandard.ZstdError as error:
        raise DamagedError("a chunk that cannot be unpacked") from error
    if zlib.crc32(records) != crc:
        raise DamagedError("a chunk with a wrong checksum")
    return records


def _is_chunk(body: bytes) -> bool:
    at = _CHUNK_HEAD.size
    return (
        len(body) >= at + 12
        and body[at - 4 : at + 4] == _ZSTD
        and _U64.unpack_from(body, at + 4)[0] == len(body) - at - 12
    )


def _check_other(opcode: int, body: bytes) -> None:
    """Raise if a record other than a chunk contradicts its opcode."""
    if opcode not in _KNOWN:
        raise DamagedError(f"a record of unknown kind {opcode:#04x}")
    if _is_chunk(body):
        raise DamagedError("a chunk with a damaged opcode")
    if opcode == _MESSAGE:
        raise DamagedError("a message outside of chunks, which no checksum protects")
    if opcode == _DATA_END and len(body) != 4:
        raise DamagedError("a damaged end of data")
    if opcode == _FOOTER and len(body) != 20:
        raise DamagedError("a damaged footer")
    if opcode == _MESSAGE_INDEX and not (
        len(body) >= 6 and _U32.unpack_from(body, 2)[0] == len(body) - 6
    ):
        raise DamagedError("a damaged index")


def _check_length(file: BinaryIO, offset: int, body: bytes, size: int) -> None:
    """Raise if a whole chunk begins within a record, which its length must not span."""
    begin = offset + RECORD.size
    # An index of each chunk names its packing, too: the file is asked only where one may begin.
    inside = [
        candidate
        for candidate in _candidates(body, begin)
        if candidate > offset and (candidate < begin or body[candidate - begin] == CHUNK)
    ]
    if not inside:
        return
    if any(_chunk_at(file, candidate, size) for candidate in inside):
        raise DamagedError("a record of a damaged length")
    file.seek(begin + len(body))


def next_chunk(file: BinaryIO, start: int, size: int) -> int:
    """Offset of the next complete chunk from `start` on; `size` if there is none."""
    position = start
    overlap = len(_ZSTD) - 1
    while position < size:
        file.seek(position)
        window = file.read(_STEP + overlap)
        for candidate in _candidates(window, position):
            if candidate >= start and _chunk_at(file, candidate, size):
                return candidate
        position += _STEP
    return size


def _candidates(data: bytes, offset: int) -> Iterator[int]:
    """Where chunks may begin in `data`, which lies at `offset`."""
    at = data.find(_ZSTD)
    while at >= 0:
        yield offset + at - _BEFORE_ZSTD
        at = data.find(_ZSTD, at + 1)


def _chunk_at(file: BinaryIO, offset: int, size: int) -> bool:
    file.seek(offset)
    head = file.read(_BEFORE_ZSTD + len(_ZSTD) + 8)
    opcode, length = RECORD.unpack_from(head)
    inner = _U64.unpack_from(head, len(head) - 8)[0]
    whole = length == inner + _CHUNK_HEAD.size + 12 and offset + RECORD.size + length <= size
    return bool(opcode == CHUNK and whole)
