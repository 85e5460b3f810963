"""Makes bombs: small files that ask their reader for much memory, time or depth."""

import io
import random
import struct
import zlib
from collections.abc import Callable
from typing import Any

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard

from benchmarks.malformed.records import chunk_of, record_of
from rigwatch.wire.bus import MAX_PAYLOAD
from rigwatch.wire.session.chunks import MAGIC

Bomb = tuple[str, Callable[[], bytes]]
"""What it does, and its bytes."""
MB = 1 << 20
HUGE = 1 << 60
_MAT_HEAD = b"MATLAB 5.0".ljust(124) + b"\x00\x01IM"
_ZIPPED, _MATRIX, _INT8 = 15, 14, 1  # data types of MAT files


def bombs(chance: random.Random, session: bytes) -> dict[str, list[Bomb]]:
    """Bombs by the kind of file, their sizes drawn.

    Args:
        chance: draws them.
        session: an intact session, for those that hide in one.
    """
    size, other = (chance.randrange(256, 1024) * MB for _ in range(2))
    many = chance.randrange(2, 6) * 1_000_000
    depth = chance.randrange(20_000, 80_000)
    return {
        "mcap": _sessions(size, other, many, session),
        "mat": _matlab(size, other, many, depth // 100),
        "csv": _tables(size // 16, many, depth),
        "parquet": _columns(size // 8, depth // 4),
        "toml": _settings(depth, many // 4),
        "protobuf": _messages(depth, MAX_PAYLOAD // 2),
    }


def _sessions(size: int, other: int, many: int, session: bytes) -> list[Bomb]:
    begun = session[: -len(MAGIC)]

    def zstd(length: int, claimed: int | None = None) -> bytes:
        records = bytes(length)
        return chunk_of(records, zstandard.compress(records), b"zstd", claimed)

    def lz4_of(length: int, claimed: int | None = None) -> bytes:
        records = bytes(length)
        return chunk_of(records, lz4.frame.compress(records), b"lz4", claimed)

    def small_records() -> bytes:
        records = record_of(0x7F, b"") * many
        return chunk_of(records, zstandard.compress(records), b"zstd")

    def others(records: bytes) -> bytes:
        """An intact session, and forty chunks of what is no message of rigwatch."""
        channel = record_of(4, struct.pack("<HHI6sI4sI", 77, 0, 6, b"camera", 4, b"json", 0))
        records = channel + records * ((60 * MB) // len(records))
        return begun + chunk_of(records, zstandard.compress(records), b"zstd") * 40 + MAGIC

    message = record_of(5, struct.pack("<HIQQ", 77, 0, 0, 0))
    declared = record_of(3, struct.pack("<HI5sI4sI", 9, 5, b"Image", 4, b"json", 0))
    return [
        ("unpacks to much", lambda: MAGIC + zstd(size) + MAGIC),
        ("unpacks to much by lz4", lambda: MAGIC + lz4_of(other) + MAGIC),
        ("unpacks to more than it says", lambda: begun + zstd(other, 100) + MAGIC),
        ("unpacks by lz4 to more than it says", lambda: begun + lz4_of(size, 100) + MAGIC),
        ("says that it unpacks to 10^18 bytes", lambda: begun + zstd(100, HUGE) + MAGIC),
        ("millions of empty records", lambda: MAGIC + small_records() + MAGIC),
        ("a record of 10^18 bytes", lambda: begun + struct.pack("<BQ", 5, HUGE) + MAGIC),
        ("many chunks", lambda: MAGIC + zstd(64 * MB) * 40 + MAGIC),
        ("millions of messages of others", lambda: others(message)),
        ("millions of declarations", lambda: others(declared)),
    ]


def _element(kind: int, data: bytes, claimed: int | None = None) -> bytes:
    return struct.pack("<II", kind, len(data) if claimed is None else claimed) + data


def _matlab(size: int, other: int, many: int, depth: int) -> list[Bomb]:
    def zipped(data: bytes) -> bytes:
        return _element(_ZIPPED, zlib.compress(data, 1))

    def within(levels: int) -> bytes:
        data = bytes(64 * MB)
        for _ in range(levels):
            data = zipped(data)
        return data

    def nested_cells() -> bytes:
        data = b""
        for _ in range(depth):
            cell = _element(6, struct.pack("<II", 1, 0)) + _element(5, struct.pack("<ii", 1, 1))
            data = _element(_MATRIX, cell + _element(_INT8, b"") + data)
        return data

    small = struct.pack("<HHI", 1, 0, 0)
    dimensions = struct.pack("<ii", 2**31 - 1, 2**31 - 1)
    vast = _element(6, struct.pack("<II", 6, 0)) + _element(5, dimensions) + _element(_INT8, b"x")
    return [
        ("unpacks to much", lambda: _MAT_HEAD + zipped(bytes(size))),
        ("unpacks to a matrix", lambda: _MAT_HEAD + zipped(_element(_MATRIX, bytes(other)))),
        ("zipped in zipped", lambda: _MAT_HEAD + within(4)),
        ("many parts", lambda: _MAT_HEAD + zipped(_element(_MATRIX, small * many))),
        ("cells in cells", lambda: _MAT_HEAD + nested_cells()),
        ("a matrix of 2^62 numbers", lambda: _MAT_HEAD + _element(_MATRIX, vast)),
        ("an element of 4 GB", lambda: _MAT_HEAD + _element(_MATRIX, b"x" * 100, 2**32 - 8)),
        ("many zipped parts", lambda: _MAT_HEAD + zipped(bytes(60 * MB)) * 20),
    ]  # fmt: skip


def _tables(size: int, many: int, depth: int) -> list[Bomb]:
    head = b"t,x,u\n0,1,1\n4,1,1\n"
    return [
        ("a cell without end", lambda: head + b"8,1," + b"9" * size),
        ("a quotation without end", lambda: head + b'8,1,"' + b"a\n" * (size // 2)),
        ("millions of columns", lambda: b"a," * many + b"\n" + b"0," * many),
        ("a jump of time", lambda: head + b"1e15,1,1\n1e15,1,1\n"),
        ("a time beyond all numbers", lambda: head + b"1e300,1,1\n"),
        ("an exponent of many digits", lambda: head + b"8,1e" + b"9" * depth + b",1\n"),
        ("a unit that nests", lambda: b"t,x,u [" + b"(" * depth + b"]\n0,1,1\n"),
    ]


def _columns(length: int, wide: int) -> list[Bomb]:
    def written(table: Any, **how: Any) -> bytes:
        from pyarrow import parquet

        file = io.BytesIO()
        parquet.write_table(table, file, **how)
        return file.getvalue()

    def zeros(kind: str, compression: str, **how: Any) -> bytes:
        import pyarrow

        names = {name: np.zeros(length // 8, kind) for name in "txu"}
        return written(pyarrow.table(names), compression=compression, **how)

    def many_columns() -> bytes:
        import pyarrow

        return written(pyarrow.table({f"c{n}": [0.0] for n in range(wide)}))

    def long_texts() -> bytes:
        import pyarrow

        text = "a" * (64 * MB)
        names = {"t": [0.0, 4.0], "x": [text, text], "u": [text, text]}
        return written(pyarrow.table(names), compression="zstd")

    def repeated_texts() -> bytes:
        import pyarrow

        rows = length // 4096
        texts = pyarrow.DictionaryArray.from_arrays(np.zeros(rows, np.int32), ["a" * 100_000])
        names = {"t": 4.0 * np.arange(rows), "x": texts, "u": texts}
        return written(pyarrow.table(names), compression="zstd", store_schema=False)

    return [
        ("unpacks to much", lambda: zeros("f8", "zstd")),
        ("repeats a value without packing", lambda: zeros("i8", "none")),
        ("repeats values of a byte", lambda: zeros("i1", "gzip", use_dictionary=False)),
        ("thousands of columns", many_columns),
        ("texts of 64 MB", long_texts),
        ("a text that thousands of rows repeat", repeated_texts),
    ]


def _settings(depth: int, many: int) -> list[Bomb]:
    return [
        ("lists in lists", lambda: b"a = " + b"[" * depth),
        ("tables in tables", lambda: b"a = " + b"{b=" * depth + b"1" + b"}" * depth),
        ("a name of many parts", lambda: b".".join([b"a"] * depth) + b" = 1"),
        ("a number of many digits", lambda: b"a = " + b"9" * depth),
        ("a number of many binary digits", lambda: b"a = 0b" + b"1" * (4 * depth)),
        ("many tables", lambda: b"".join(b"[[a]]\n" for _ in range(many))),
        ("a header of many parts", lambda: b"[" + b".".join([b"a"] * depth) + b"]\n"),
    ]


def _messages(depth: int, many: int) -> list[Bomb]:
    def within() -> bytes:
        data = b""
        for _ in range(min(depth, 3000)):
            data = b"\x32" + _varint(len(data) + 1) + data
        return data

    return [
        ("messages in messages that promise more", within),
        ("a field of 10^18 bytes", lambda: b"\x0a" + _varint(HUGE)),
        ("many empty columns", lambda: b"\x32\x00" * many),
        ("groups without end", lambda: b"\x0b" * depth),
        ("a number without end", lambda: b"\x08" + b"\xff" * many),
    ]


def _varint(value: int) -> bytes:
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*found, value])
