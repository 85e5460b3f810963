"""A study's folder: file and ledger change atomically, even if the process is killed.

A change is written as `study.new`, then its line with the new file's SHA-256 is appended to the
ledger, then `study.new` replaces the file. After a kill in between, the next opening completes the
change if the ledger records it and discards it otherwise.
"""

import fcntl
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from rigwatch.wire.host import write_through

FILE = "study.toml"
LEDGER = "ledger.jsonl"
NEW = "study.new"


def digest(text: str) -> str:
    """SHA-256 of a study's file, as recorded in its ledger."""
    return hashlib.sha256(text.encode()).hexdigest()


@contextmanager
def locked(folder: Path) -> Iterator[int]:
    """Lock the folder exclusively; yields the ledger's file descriptor, open for appending."""
    descriptor = os.open(folder / LEDGER, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        os.close(descriptor)


def write_step(folder: Path, ledger: int, line: bytes, text: str | None) -> None:
    """Append a line to the ledger and, given a `text`, replace the study's file.

    Args:
        folder: the study's folder, locked.
        ledger: descriptor of its ledger.
        line: the line including its newline.
        text: new content of `study.toml`.
    """
    _drop_torn_line(ledger)
    if text is not None:
        write_through(folder / NEW, text)
    os.write(ledger, line)
    os.fsync(ledger)
    if text is not None:
        (folder / NEW).replace(folder / FILE)


def settle(folder: Path) -> None:
    """Complete or discard a change interrupted between the ledger and the study's file."""
    new = folder / NEW
    if not new.exists():
        return
    with locked(folder) as ledger:
        if not new.exists():
            return
        _drop_torn_line(ledger)
        if _last_study(folder) == hashlib.sha256(new.read_bytes()).hexdigest():
            new.replace(folder / FILE)
        else:
            new.unlink()


def _last_study(folder: Path) -> str:
    """SHA-256 of the study's file in the ledger's last line; empty if there is none."""
    lines = (folder / LEDGER).read_bytes().splitlines()
    try:
        return str(msgspec.json.decode(lines[-1]).get("study", "")) if lines else ""
    except msgspec.DecodeError:
        return ""


def _drop_torn_line(ledger: int) -> None:
    """Truncate an incomplete last line."""
    size = os.fstat(ledger).st_size
    tail = os.pread(ledger, size, 0)
    whole = tail.rfind(b"\n") + 1
    if whole < size:
        os.ftruncate(ledger, whole)
