"""The file of results: JSON lines as they come, at the end one file in the order of the paths.

A line is appended whole, so a client that is killed leaves at most one torn line, which is cut off.
For Parquet the lines are kept beside the file until all results are there.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

import msgspec

from rigwatch.batch.job import Outcome
from rigwatch.batch.parquet import lines_of, write_parquet
from rigwatch.wire.errors import BatchError, HeldError, reason_of
from rigwatch.wire.host import Hold
from rigwatch.wire.new_file import sync
from rigwatch.wire.typed_files import JsonError, decoded

PARQUET = ".parquet"


class Line(msgspec.Struct, frozen=True, omit_defaults=True):
    """One line: a result (`value`) or a failure (`kind`, `error`) of a unit.

    Attributes:
        path: the recording or study.
        content: hash of its content.
        work: hash of job, settings and version.
    """

    path: str
    content: str
    work: str
    value: msgspec.Raw
    kind: str = ""
    error: str = ""

    def outcome(self) -> Outcome:
        """The result without the identity of the work."""
        value = b"" if self.kind else bytes(self.value)
        return Outcome(self.path, self.content, value, self.kind, self.error)


_DECODER = msgspec.json.Decoder(Line)


def as_line(outcome: Outcome, work: str) -> bytes:
    """An outcome as a line with its end."""
    value = msgspec.Raw(outcome.value or b"null")
    line = Line(outcome.path, outcome.content, work, value, outcome.kind, outcome.error)
    return msgspec.json.encode(line) + b"\n"


class _Place(NamedTuple):
    """Where a line lies, and the kind of failure that it holds, "" for a result."""

    at: int
    length: int
    kind: str


class Journal:
    """The results so far, in a file or in memory.

    Args:
        file: `.jsonl` or `.parquet`; None keeps results in memory.
        work: hash of job, settings and version; results of other work are refused.

    Raises:
        BatchError: the file cannot be used, is in use, or holds results of other work.
        MissingExtraError: Parquet without pyarrow.
    """

    def __init__(self, file: Path | None, work: str) -> None:
        self.file, self.work = file, work
        self._lines: dict[str, _Place] = {}
        self._memory = bytearray()
        self._file = None if file is None else self._opened(file)
        try:
            self._read()
        except BaseException:
            self.close()
            raise

    def _opened(self, file: Path) -> BinaryIO:
        """The journal, locked: nothing else opens it, as closing it would free the lock."""
        beside = journal_of(file)
        self._alone = Hold(beside)
        try:
            self._alone.take()
            return self._filled(file, beside)
        except HeldError as error:
            raise BatchError(f"{file}: is in use by another run ({error})") from None
        except OSError as error:
            self._alone.give_up()
            raise BatchError(f"{file}: cannot be written: {reason_of(error)}") from None
        except BaseException:
            self._alone.give_up()
            raise

    def _filled(self, file: Path, beside: Path) -> BinaryIO:
        """The journal, open, with what a finished file of Parquet holds."""
        opened = beside.open("a+b")
        try:
            if file.suffix == PARQUET and file.exists() and not opened.tell():
                opened.writelines(lines_of(file))
                opened.flush()
        except BaseException:
            opened.close()
            raise
        return opened

    def _read(self) -> None:
        """Index the lines that are there; cut off a torn one."""
        if self._file is None:
            return
        self._file.seek(0)
        end = 0
        for raw in self._file:
            if not raw.endswith(b"\n"):
                break
            self._take(raw, end)
            end += len(raw)
        self._file.truncate(end)

    def _take(self, raw: bytes, at: int) -> None:
        try:
            line = decoded(raw, _DECODER)
        except JsonError:
            text = "holds a line that is no result, expected another name for new results"
            raise BatchError(f"{self.file}: {text}") from None
        if line.work != self.work:
            text = "holds results of another job, other settings or another version of rigwatch"
            raise BatchError(f"{self.file}: {text}, expected a new file")
        self._lines[line.path] = _Place(at, len(raw), line.kind)

    def get(self, path: str) -> Outcome | None:
        """The result of a unit, None if there is none."""
        place = self._lines.get(path)
        return None if place is None else _DECODER.decode(self._at(place)).outcome()

    def kinds(self, paths: Iterable[str]) -> Iterator[str]:
        """Kind of failure of each unit that was done, "" for one that has a result."""
        return (self._lines[path].kind for path in paths if path in self._lines)

    def add(self, outcomes: Sequence[Outcome]) -> None:
        """Append results that came together; each replaces an earlier one of its unit.

        Raises:
            BatchError: the disk is full or gone.
        """
        lines = [as_line(outcome, self.work) for outcome in outcomes]
        at = self._append(b"".join(lines))
        for outcome, line in zip(outcomes, lines, strict=True):
            self._lines[outcome.path] = _Place(at, len(line), outcome.kind)
            at += len(line)

    def _append(self, raw: bytes) -> int:
        """Write at the end, in one piece; return where it begins."""
        if self._file is None:
            at = len(self._memory)
            self._memory += raw
            return at
        try:
            at = self._file.seek(0, os.SEEK_END)
            self._file.write(raw)
            self._file.flush()
        except OSError as error:
            raise BatchError(f"{self.file}: cannot be written: {reason_of(error)}") from None
        return at

    def outcomes(self, paths: Iterable[str]) -> Iterator[Outcome]:
        """Results of the units, in the given order."""
        for path in paths:
            if (found := self.get(path)) is not None:
                yield found

    def finish(self, paths: Sequence[str]) -> None:
        """Write all results in place of the journal, ordered by path.

        Those of other units, which an earlier run has worked on, stay. A unit that has another
        path now does not stand there twice.

        Args:
            paths: the units of this run, in their order, which is kept if there are no others.
        """
        if self.file is None:
            return
        others = self._others(paths)
        order = sorted({*paths, *others}) if others else paths
        lines = (self._at(self._lines[path]) for path in order if path in self._lines)
        beside = journal_of(self.file)
        temporary = self.file.with_name(f".{self.file.name}.new")
        if self.file.suffix == PARQUET:
            write_parquet(temporary, lines)
        else:
            with temporary.open("wb") as file:
                file.writelines(lines)
        _replace(temporary, self.file)
        if beside != self.file:
            beside.unlink()

    def _others(self, paths: Sequence[str]) -> list[str]:
        """Units that are none of these, however their paths are written."""
        own = set(paths)
        if own.issuperset(self._lines):
            return []
        places = {os.path.realpath(path) for path in paths}
        further = (path for path in self._lines if path not in own)
        return [path for path in further if os.path.realpath(path) not in places]

    def _at(self, place: _Place) -> bytes:
        at, length, _ = place
        if self._file is None:
            return bytes(self._memory[at : at + length])
        return os.pread(self._file.fileno(), length, at)

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            with suppress(OSError):  # it tries once more to write what could not be, as was said
                self._file.close()
            self._alone.give_up()


def journal_of(file: Path) -> Path:
    """Where results are appended until all are there."""
    return file.with_name(f"{file.name}.jsonl") if file.suffix == PARQUET else file


def _replace(temporary: Path, file: Path) -> None:
    """Put a whole file in place, on the disk before anything is removed."""
    sync(temporary)
    temporary.replace(file)


def check_target(file: Path | None) -> None:
    """Refuse a file of results that cannot be written, before long work begins.

    Raises:
        BatchError: its ending is unknown, or its folder does not exist.
    """
    if file is None:
        return
    if file.suffix not in (PARQUET, ".jsonl"):
        raise BatchError(f"{file}: found the ending {file.suffix!r}, expected .jsonl or .parquet")
    if not file.absolute().parent.is_dir():
        raise BatchError(f"{file}: found no folder {file.parent}, expected one to write to")


def read_outcomes(file: Path) -> Iterator[Outcome]:
    """The outcomes in a finished file of results."""
    if file.suffix == PARQUET:
        yield from (_DECODER.decode(line).outcome() for line in lines_of(file))
        return
    with file.open("rb") as lines:
        for line in lines:
            yield _DECODER.decode(line).outcome()
