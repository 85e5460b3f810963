"""The alarm journal: an append-only file of JSON lines that stays readable after a kill.

    {"alarm": {"name": "dry_friction", "state": "unacknowledged", …}, "active": true, …}

Each write ends with fsync, so everything published is on disk. A line torn by a kill or a power cut
has no newline or is not valid JSON: reading skips and counts it, and writing continues on a new
line. So it does with one whose numbers or words no message can hold, as of a damaged disk.
Non-finite numbers are written as the strings "nan", "inf" and "-inf".
"""

import errno
import json
import math
import os
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import MISSING, asdict, fields
from pathlib import Path
from typing import Any, BinaryIO, Literal, get_args, get_origin, get_type_hints

from monitor.alarms.record import AlarmRecord
from rigwatch.wire.errors import SessionError, reason_of
from rigwatch.wire.messages import Alarm
from rigwatch.wire.new_file import sync

_ALARM_TYPES = get_type_hints(Alarm)
_RECORD_TYPES = get_type_hints(AlarmRecord)
_INTEGERS = range(-(2**63), 2**63)
LARGEST, KEPT = 16 << 20, 8
"""Size at which a journal is rotated [bytes], and number of older files kept."""
MOST_WAITING = 4096
"""Records that wait for a disk which cannot be written, some 3 MB of them."""
LONGEST_LINE = 1 << 16
"""Longest line read, far above any line written [bytes]."""
END = 1 << 16
"""Length of a journal's end [bytes]: a hundred records."""


class AlarmJournal:
    """The journal at one path, open for appending.

    Args:
        path: the file; it and its folder are created if missing.
        largest: size at which it is rotated [bytes]: renamed to `<path>.1`, older ones to `.2` and
            so on, and continued with the newest record of each alarm.

    Attributes:
        failure: why the last write failed, otherwise ""; unwritten lines stay in memory for the
            next write. Of more than `MOST_WAITING` only the newest of each alarm stay, and what is
            left out is told here.

    Raises:
        SessionError: the file cannot be opened.
    """

    def __init__(self, path: Path | str, largest: int = LARGEST) -> None:
        self.path = Path(path)
        self.failure = ""
        self._largest = largest
        self._waiting: list[bytes] = []
        self._left_out = 0
        self._file: int | None = None
        try:
            self._newest = _newest(self.path)
            self._open()
        except OSError as error:
            # A disk that has become read-only must not leave the rig unwatched: it can be read.
            if error.errno != errno.EROFS:
                raise SessionError(
                    f"{path}: alarm journal cannot be opened: {reason_of(error)}"
                ) from error
            self._fail(error)

    def _open(self) -> int:
        """Open the file for appending, if it is not open."""
        if self._file is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                self._end_torn_line(file)
                sync(self.path.parent)
            except OSError:
                os.close(file)
                raise
            self._file = file
        return self._file

    def _fail(self, error: OSError) -> None:
        left_out = f"; {self._left_out} records are left out" if self._left_out else ""
        why = f"{reason_of(error)}{left_out}"
        self.failure = f"{self.path}: alarm journal cannot be written: {why}"

    def write(self, records: Iterable[AlarmRecord]) -> None:
        """Append records and force them to disk; a full or read-only disk only sets `failure`.

        After a failure call it again, also without records.
        """
        for record in records:
            self._waiting.append(_line(record))
            self._newest[record.alarm.name] = record
        if not (self._waiting or self.failure):
            return
        try:
            file = self._open()
            if not os.fstat(file).st_nlink:
                file = self._begin_anew()
            _write_all(file, self._waiting)
            os.fsync(file)
            if os.fstat(file).st_size > self._largest:
                self._rotate()
        except OSError as error:
            if len(self._waiting) > MOST_WAITING:
                self._leave_out()
            self._fail(error)
            return
        self.failure, self._left_out = "", 0

    def _leave_out(self) -> None:
        """Leave out what waits but the newest record of each alarm: a disk may be full for days."""
        kept = [*map(_line, self._newest.values())]
        waiting = sum(line != b"\n" for line in self._waiting)
        self._left_out += max(0, waiting - len(kept))
        torn = self._waiting[0].startswith(b"\n")
        self._waiting = [b"\n", *kept] if torn else kept

    def newest(self) -> list[AlarmRecord]:
        """The newest record of each alarm: the initial state of a restarted monitor."""
        return list(self._newest.values())

    def _rotate(self) -> None:
        """Rotate the file and start one that holds the newest record of each alarm.

        A complete journal is at the path at all times: a kill or power cut loses nothing.
        """
        beside, file = self._fresh()
        try:
            copy = self._copied()
            for number in range(KEPT - 1, 0, -1):
                if (older := self._set_aside(number)).exists():
                    older.replace(self._set_aside(number + 1))
            copy.replace(self._set_aside(1))
        except OSError:
            os.close(file)
            raise
        self._take(beside, file)

    def _copied(self) -> Path:
        """The file under another name too; it is there before older ones make room for it."""
        copy = self._set_aside(0)
        copy.unlink(missing_ok=True)
        try:
            copy.hardlink_to(self.path)
        except OSError:  # a file system without links, as of a memory card
            shutil.copyfile(self.path, copy)
        return copy

    def _begin_anew(self) -> int:
        """Somebody has removed the file: what is written to it now would be lost without an error.

        A file that has come in its place, as of a backup, is set aside.
        """
        if self.path.exists():
            self.path.replace(self.path.with_name(f"{self.path.name}.set-aside"))
        beside, file = self._fresh()
        self._take(beside, file)
        self._waiting.clear()  # the newest of each alarm is there
        return file

    def _fresh(self) -> tuple[Path, int]:
        """A file beside the journal that holds the newest record of each alarm, and open."""
        beside = self.path.with_name(f"{self.path.name}.new")
        beside.parent.mkdir(parents=True, exist_ok=True)
        beside.write_bytes(journal_text(self._newest.values()))
        file = os.open(beside, os.O_RDWR | os.O_APPEND)
        try:
            os.fsync(file)
        except OSError:
            os.close(file)
            raise
        return beside, file

    def _take(self, beside: Path, file: int) -> None:
        """Put what is beside the journal in its place, and write to it from now on."""
        try:
            beside.replace(self.path)
        except OSError:
            os.close(file)
            raise
        self.close()
        self._file = file
        sync(self.path.parent)

    def _set_aside(self, number: int) -> Path:
        return self.path.with_name(f"{self.path.name}.{number}")

    def close(self) -> None:
        """Close the file; unwritten lines are lost."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def _end_torn_line(self, file: int) -> None:
        """Terminate a torn line with the next write, as there may be no space for it now."""
        size = os.fstat(file).st_size
        if size and os.pread(file, 1, size - 1) != b"\n":
            self._waiting.insert(0, b"\n")


def _newest(path: Path) -> dict[str, AlarmRecord]:
    """The newest record of each alarm, in memory independent of the journal's length."""
    if not path.is_file():  # a device may be endless
        return {}
    with path.open("rb") as file:
        parsed = (_parse(line) for line in _lines(file) if line.strip())
        return {record.alarm.name: record for record in parsed if record is not None}


def read_journal(path: Path | str) -> tuple[list[AlarmRecord], int]:
    """All records in order, and the number of lines that could not be read.

    Raises:
        SessionError: the file exists and cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            parsed = [_parse(line) for line in _lines(file) if line.strip()]
    except FileNotFoundError:
        return [], 0
    except OSError as error:
        raise SessionError(f"{path}: alarm journal cannot be read: {reason_of(error)}") from error
    records = [record for record in parsed if record is not None]
    return records, len(parsed) - len(records)


def read_end(path: Path | str) -> list[AlarmRecord]:
    """The last records of a journal, in order; none if it cannot be read."""
    try:
        with Path(path).open("rb") as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - END))
            parsed = [_parse(line) for line in _lines(file)]
    except OSError:
        return []
    return [record for record in parsed if record is not None]


def journal_text(records: Iterable[AlarmRecord]) -> bytes:
    """A journal of `records` as this version writes it."""
    return b"".join(map(_line, records))


def _lines(file: BinaryIO) -> Iterator[bytes]:
    """The lines of a journal; overlong lines are truncated."""
    while line := file.readline(LONGEST_LINE):
        yield line
        while len(line) == LONGEST_LINE and not line.endswith(b"\n"):
            line = file.readline(LONGEST_LINE)


def _write_all(file: int, waiting: list[bytes]) -> None:
    """Write lines and remove them one by one; a partly written line is repeated in full."""
    while waiting:
        line = waiting[0]
        if os.write(file, line) < len(line):
            waiting[0] = b"\n" + line.lstrip(b"\n")
            continue
        del waiting[0]


def _line(record: AlarmRecord) -> bytes:
    plain = asdict(record)
    plain["alarm"] = {name: _json_value(value) for name, value in plain["alarm"].items()}
    return json.dumps(plain, ensure_ascii=False, allow_nan=False).encode() + b"\n"


def _json_value(value: object) -> object:
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def _parse(line: bytes) -> AlarmRecord | None:
    try:
        plain = json.loads(line)
        alarm = Alarm(**_typed(plain.pop("alarm"), Alarm, _ALARM_TYPES))
        return AlarmRecord(alarm=alarm, **_typed(plain, AlarmRecord, _RECORD_TYPES))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _typed(plain: dict[str, Any], kind: type, types: dict[str, Any]) -> dict[str, Any]:
    """The fields of `kind` from `plain`, with numbers converted to their types.

    Fields that have a default may be missing: they are younger than some journals.

    Raises:
        KeyError: a field is missing.
        TypeError: a field has the wrong type.
    """
    typed: dict[str, Any] = {}
    known = [one.name for one in fields(kind) if one.name in plain or one.default is MISSING]
    for name in [name for name in known if name != "alarm"]:
        value = float(plain[name]) if types[name] is float else plain[name]
        if not _is_of(types[name], value):
            raise TypeError(name)
        typed[name] = value
    return typed


def _is_of(kind: Any, value: object) -> bool:
    """Whether a value is of the type of a field, and a message can hold it."""
    if get_origin(kind) is Literal:
        return value in get_args(kind)
    return isinstance(value, kind) and (not isinstance(value, int) or value in _INTEGERS)
