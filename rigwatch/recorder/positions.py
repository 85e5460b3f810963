"""Position of a recording in the numbered topics, stored beside its segments.

    positions := half, at 0 | half, at 64 kB
    half      := CRC-32 of the rest u32 | length u32 | number of the save u64 | positions in JSON

A recorder that was killed and restarted queries the rings from there on. The file is written after
the segment: a kill in between repeats messages of half a second but loses none. Saves go to both
halves in turn and in place, which takes no new file, rename or wait for the disk: a save that is
torn leaves the one before it.
"""

import contextlib
import os
import struct
import zlib
from pathlib import Path

import msgspec

from rigwatch.wire.bus import Place
from rigwatch.wire.typed_files import JsonError, json_value

FILE = "positions"
FILE_BEFORE = "positions.json"
"""The file of earlier versions, read where there is no other."""
FILES = (FILE, FILE_BEFORE)
HALF = 1 << 16
"""Room for one save, of which most stays a hole in the file; three kilobytes are many [bytes]."""
_CRC = struct.Struct("<I")
_HEAD = struct.Struct("<IQ")
Positions = dict[str, dict[str, Place]]
"""For each numbered topic and process: run and number of the last stored message."""


class PositionFile:
    """The positions of the recording in `folder`, saved again and again by its one recorder."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._number = 1 + max((number for number, _ in _saves(self._path)), default=-1)

    def save(self, positions: Positions) -> None:
        """Write the positions; a disk that cannot be written is reported by the segments."""
        text = msgspec.json.encode(positions)
        data = _HEAD.pack(len(text), self._number) + text
        data = _CRC.pack(zlib.crc32(data)) + data
        # The same half again after a failure: the other one is whole.
        with contextlib.suppress(OSError):
            if len(data) <= HALF and self._written(data) == len(data):
                self._number += 1

    def _written(self, data: bytes) -> int:
        file = os.open(self._path, os.O_WRONLY | os.O_CREAT, 0o644)
        try:
            return os.pwrite(file, data, HALF * (self._number % 2))
        finally:
            os.close(file)


def load_positions(folder: Path) -> Positions:
    """The positions stored in `folder`; empty if they cannot be read."""
    try:
        saves = _saves(folder / FILE)
        text = max(saves)[1] if saves else (folder / FILE_BEFORE).read_bytes()
        return json_value(text, Positions)
    except (OSError, JsonError):
        return {}


def _saves(path: Path) -> list[tuple[int, bytes]]:
    """Number and content of the halves that are whole."""
    try:
        data = path.read_bytes()
    except OSError:
        return []
    return [save for half in (data[:HALF], data[HALF:]) if (save := _save(half))]


def _save(half: bytes) -> tuple[int, bytes] | None:
    head = _CRC.size + _HEAD.size
    if len(half) < head:
        return None
    length, number = _HEAD.unpack_from(half, _CRC.size)
    whole = zlib.crc32(half[_CRC.size : head + length]) == _CRC.unpack_from(half)[0]
    return (number, half[head : head + length]) if length and whole else None
