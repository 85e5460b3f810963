"""Records of session files, with right lengths and checksums around any content."""

import struct
import zlib

CHUNK = 6


def record_of(opcode: int, body: bytes) -> bytes:
    """A record."""
    return struct.pack("<BQ", opcode, len(body)) + body


def chunk_of(records: bytes, packed: bytes, kind: bytes, size: int | None = None) -> bytes:
    """A chunk of packed records.

    Args:
        records: unpacked.
        packed: the same, packed by `kind`.
        size: what it says that it unpacks to; None for the truth.
    """
    claimed = len(records) if size is None else size
    head = struct.pack("<QQQI", 0, 1, claimed, zlib.crc32(records))
    body = head + struct.pack("<I", len(kind)) + kind + struct.pack("<Q", len(packed)) + packed
    return record_of(CHUNK, body)
