"""Messages of a process in a file, so that its next run answers for what this one has sent.

    file      two halves of 256 KiB, written in turn; the older one is forgotten when it is needed
    half      magic (8 bytes), turn (int64), CRC-32 of both; then records; then zeros
    record    length of the payload, CRC-32 (uint32 each), run, number (int64 each), payload

Little endian; a record's checksum includes the half's turn. Number -1 begins a run, with the boot
id of the machine as payload; -2 ends one whose process was not killed.

A message is stored before it is sent, and not forced to the disk: what a killed process has written
is kept by the kernel. After a restart of the machine, or where a half is damaged, the last message
that is found need not have been the last one that was sent; then the run is not complete. The file
has its full size from the start, so a full disk does not keep it from being written.
"""

import contextlib
import os
import struct
import zlib
from collections import deque
from dataclasses import replace
from pathlib import Path

from rigwatch.wire.bus.transport import MAX_PAYLOAD
from rigwatch.wire.errors import MessageError
from rigwatch.wire.ordering import Numbered, PastRun, PastRuns

HALF = 1 << 18
"""Size of a half [bytes]: at least the last 256 KiB of messages are kept, of alarms a thousand."""
BEGIN, END = -1, -2
MOST_WAITING = 4096
"""Messages that wait while the file cannot be written."""
_MAGIC = b"rigsaid1"
_HEAD = struct.Struct("<8sqI")
_RECORD = struct.Struct("<IIqq")
_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


class KeptMessages:
    """The file at one path, open for writing, and what the earlier runs have left in it.

    A file that cannot be opened or written is tried again with each call; what cannot be stored
    then is missing for the next run only.

    Args:
        path: the file; it and its folder are created if missing.
        half: size of a half [bytes].

    Attributes:
        past: the earlier runs.
    """

    def __init__(self, path: Path | str, half: int = HALF) -> None:
        self._path, self._half = Path(path), half
        self._file: int | None = None
        self._turn = self._at = 0
        self._run = 0
        self._closed = False
        self._waiting: deque[Numbered] = deque(maxlen=MOST_WAITING)
        self._runs: list[PastRun] = []
        with contextlib.suppress(OSError):
            self._open()

    @property
    def past(self) -> PastRuns:
        """The earlier runs."""
        return PastRuns(self._runs, MAX_PAYLOAD // 2)

    @property
    def payloads(self) -> frozenset[bytes]:
        """All messages of the earlier runs."""
        return frozenset(one.payload for run in self._runs for one in run.messages)

    @property
    def newest(self) -> bytes | None:
        """The last message of the earlier runs; None if there is none."""
        kept = [one.payload for run in self._runs for one in run.messages]
        return kept[-1] if kept else None

    def complete(self, payloads: list[bytes] | None) -> None:
        """Add to the last earlier run what it was about to send when it was killed.

        Args:
            payloads: the messages; None if that is not known.
        """
        if not self._runs:
            return
        last = self._runs[-1]
        if payloads is None or not last.complete:
            self._runs[-1] = replace(last, complete=False)
            return
        first = last.messages[-1].seq + 1 if last.messages else 0
        added = [Numbered(last.run, first + i, one) for i, one in enumerate(payloads)]
        for message in added:
            self.write(message)
        self._runs[-1] = replace(last, messages=(*last.messages, *added))

    def begin(self, run: int) -> None:
        """Begin a run; the messages that follow are its own."""
        self._run = run
        self.write(self._beginning())

    def write(self, message: Numbered | None = None) -> None:
        """Store a message, and those that could not be stored before."""
        if message is not None:
            self._waiting.append(message)
        with contextlib.suppress(OSError):
            while self._waiting and not self._closed:
                self._put(self._waiting[0])
                self._waiting.popleft()

    def close(self) -> None:
        """End the run: all that it has sent is on the disk."""
        if self._run:
            self.write(Numbered(self._run, END, b""))
        self._closed = True
        if self._file is not None:
            with contextlib.suppress(OSError):
                os.fdatasync(self._file)
            os.close(self._file)
            self._file = None

    def _beginning(self) -> Numbered:
        return Numbered(self._run, BEGIN, _boot_id())

    def _open(self) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            self._read(file)
        except OSError:
            os.close(file)
            raise
        self._file = file

    def _read(self, file: int) -> None:
        content = os.pread(file, 2 * self._half, 0)
        halves = _halves(content, self._half)
        if not halves:
            _write_at(file, bytes(2 * self._half), 0)
            self._begin_half(file, 1)
            return
        self._runs = _runs_of(halves)
        self._turn, self._at = halves[-1].turn, halves[-1].end
        if halves[-1].damaged:
            self._begin_half(file, self._turn + 1)

    def _begin_half(self, file: int, turn: int) -> None:
        """Forget the older half and write to it from now on."""
        start = (turn % 2) * self._half
        _write_at(file, bytes(self._half), start)
        head = _MAGIC + turn.to_bytes(8, "little")
        _write_at(file, head + zlib.crc32(head).to_bytes(4, "little"), start)
        self._turn, self._at = turn, _HEAD.size

    def _put(self, message: Numbered) -> None:
        if self._file is None:
            self._open_anew()
        assert self._file is not None
        record = _record(self._turn, message)
        if self._at + len(record) > self._half:
            self._begin_half(self._file, self._turn + 1)
            if self._run and message.seq != BEGIN:
                self._append(self._file, _record(self._turn, self._beginning()))
            record = _record(self._turn, message)
        if self._at + len(record) <= self._half:  # a larger one is missing by its number
            self._append(self._file, record)

    def _append(self, file: int, record: bytes) -> None:
        _write_at(file, record, (self._turn % 2) * self._half + self._at)
        self._at += len(record)

    def _open_anew(self) -> None:
        """Open the file late: what it holds of earlier runs says nothing of the last ones."""
        with contextlib.suppress(FileNotFoundError):
            self._path.unlink()
        self._open()
        if self._run and (not self._waiting or self._waiting[0].seq != BEGIN):
            self._put(self._beginning())


def kept_runs(path: Path, half: int = HALF) -> list[PastRun]:
    """The runs in a file, which is left as it is and may be in use.

    Args:
        path: the file.
        half: size of a half [bytes].

    Raises:
        OSError: it cannot be read.
        MessageError: a half cannot be read, so that nothing in the file counts.
    """
    with path.open("rb") as file:
        content = file.read(2 * half)
    halves = _halves(content, half)
    if content.strip(b"\0") and not halves:
        raise MessageError(f"{path}: found a damaged half, expected two of {half} bytes")
    return _runs_of(halves)


class _Half:
    """What one half holds.

    Attributes:
        turn: its turn, larger than that of the other half if it is the newer one.
        records: in order.
        end: where the next record is written [bytes].
        damaged: something else than zeros follows the last record.
    """

    def __init__(self, turn: int, content: bytes) -> None:
        self.turn = turn
        self.records: list[Numbered] = []
        self.end = _HEAD.size
        while (record := self._next(content)) is not None:
            self.records.append(record)
            self.end += _RECORD.size + len(record.payload)
        self.damaged = bool(content[self.end :].strip(b"\0"))

    def _next(self, content: bytes) -> Numbered | None:
        if self.end + _RECORD.size > len(content):
            return None
        length, checksum, run, number = _RECORD.unpack_from(content, self.end)
        start = self.end + _RECORD.size
        if not checksum or start + length > len(content):
            return None
        message = Numbered(run, number, content[start : start + length])
        return message if _checksum(self.turn, message) == checksum else None


def _halves(content: bytes, size: int) -> list[_Half]:
    """The halves of a file in which something is, the older one first; none if one is unreadable.

    What a half without a head has held is not known, nor what is missing then.
    """
    found = []
    for place in (0, 1):
        half = content[place * size : (place + 1) * size]
        if not half.strip(b"\0"):
            continue
        magic, turn, checksum = _HEAD.unpack_from(half.ljust(_HEAD.size, b"\0"))
        whole = len(half) == size and checksum == zlib.crc32(half[: _HEAD.size - 4])
        if magic != _MAGIC or not whole or turn % 2 != place:
            return []
        found.append(_Half(turn, half))
    return sorted(found, key=lambda half: half.turn)


def _runs_of(halves: list[_Half]) -> list[PastRun]:
    """The runs in the halves, in the order in which they began."""
    messages: dict[int, list[Numbered]] = {}
    unknown_end: set[int] = set()
    ended: set[int] = set()
    for half in halves:
        for record in half.records:
            kept = messages.setdefault(record.boot, [])
            if record.seq == BEGIN and record.payload != (_boot_id() or None):
                unknown_end.add(record.boot)
            elif record.seq == END:
                ended.add(record.boot)
            elif record.seq >= 0:
                kept.append(record)
        if half.damaged and messages:
            last = [*messages][-1]
            unknown_end.add(last)
            ended.discard(last)
    complete = ended | (messages.keys() - unknown_end)
    return [PastRun(run, tuple(found), run in complete) for run, found in messages.items()]


def _record(turn: int, message: Numbered) -> bytes:
    checksum = _checksum(turn, message)
    head = _RECORD.pack(len(message.payload), checksum, message.boot, message.seq)
    return head + message.payload


def _checksum(turn: int, message: Numbered) -> int:
    """CRC-32 of turn and message; never 0, which marks the end."""
    return zlib.crc32(message.to_bytes(), zlib.crc32(turn.to_bytes(8, "little"))) or 1


def _boot_id() -> bytes:
    """What distinguishes this start of the machine from all others; nothing if it is not told."""
    with contextlib.suppress(OSError):
        return _BOOT_ID.read_bytes().strip()
    return b""


def _write_at(file: int, content: bytes, start: int) -> None:
    """Write all of it; a disk that takes only a part is full."""
    written = 0
    while written < len(content):
        written += os.pwrite(file, content[written:], start + written)
