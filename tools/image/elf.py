"""Reads ELF files: whether one is a program, and which shared libraries it needs.

Source: System V ABI, chapters 4 and 5 (ELF-64, little-endian: x86-64 and ARM64).
"""

import mmap
import struct
from dataclasses import dataclass
from pathlib import Path

_MAGIC = b"\x7fELF\x02\x01"
_EXECUTABLE = 2  # e_type
_LOAD, _DYNAMIC, _INTERPRETER = 1, 2, 3  # p_type
_NEEDED, _STRINGS, _SONAME, _RPATH, _RUNPATH, _FLAGS_1 = 1, 5, 14, 15, 29, 0x6FFFFFFB  # d_tag
_PIE = 0x08000000  # in DT_FLAGS_1


@dataclass(frozen=True)
class Elf:
    """What the loader reads of one file.

    Attributes:
        is_program: it can be started by itself, so it is no shared library.
        needed: names of the shared libraries it needs.
        folders: where it looks for them first.
        loader: the program that loads it, "" if none.
    """

    is_program: bool
    needed: tuple[str, ...]
    folders: tuple[Path, ...]
    loader: str


def read_elf(path: Path) -> Elf | None:
    """The header of a file; None if it is not ELF, or of another kind of machine."""
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            return None
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return _read(data, path)


def _read(data: mmap.mmap, path: Path) -> Elf:
    kind = struct.unpack_from("<H", data, 16)[0]
    (start,) = struct.unpack_from("<Q", data, 32)
    size, count = struct.unpack_from("<HH", data, 54)
    segments = [_segment(data, start + size * n) for n in range(count)]
    loader = next((_text(data, at) for what, at, _, _ in segments if what == _INTERPRETER), "")
    entries = [
        entry
        for what, at, _, length in segments
        if what == _DYNAMIC
        for entry in struct.iter_unpack("<qQ", data[at : at + length])
    ]
    strings = next((_offset(segments, value) for tag, value in entries if tag == _STRINGS), 0)

    def texts(*tags: int) -> tuple[str, ...]:
        return tuple(_text(data, strings + value) for tag, value in entries if tag in tags)

    pie = any(tag == _FLAGS_1 and value & _PIE for tag, value in entries)
    # The C library has an interpreter too, so that it can print its version; it has a name to be
    # linked by, as no program has.
    alone = (bool(loader) or pie) and not texts(_SONAME)
    folders = [one for text in texts(_RPATH, _RUNPATH) for one in text.split(":") if one]
    here = str(path.parent)
    at = tuple(Path(one.replace("${ORIGIN}", here).replace("$ORIGIN", here)) for one in folders)
    return Elf(kind == _EXECUTABLE or alone, texts(_NEEDED), at, loader)


def _segment(data: mmap.mmap, at: int) -> tuple[int, int, int, int]:
    """Type, offset, address and length in the file of a segment."""
    what, _, offset, address, _, length = struct.unpack_from("<IIQQQQ", data, at)
    return what, offset, address, length


def _offset(segments: list[tuple[int, int, int, int]], address: int) -> int:
    """Where in the file an address of the loaded program lies."""
    for what, offset, start, length in segments:
        if what == _LOAD and start <= address < start + length:
            return address - start + offset
    return 0


def _text(data: mmap.mmap, at: int) -> str:
    return data[at : data.find(b"\0", at)].decode()
