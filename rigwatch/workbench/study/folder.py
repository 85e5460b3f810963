"""A study's folder: its file and its ledger change together or not at all, whenever killed.

A change is written beside the file as `study.new`, then its line is appended to the ledger, which
names the new file's SHA-256, then `study.new` takes the file's place. Whoever opens the study after
a kill in between ends the change where the ledger knows of it, and drops it where it does not.
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
    """SHA-256 of a study's file, as its ledger names it."""
    return hashlib.sha256(text.encode()).hexdigest()


@contextmanager
def locked(folder: Path) -> Iterator[int]:
    """Hold the folder alone; the ledger's file descriptor, open to append."""
    descriptor = os.open(folder / LEDGER, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        os.close(descriptor)


def write_step(folder: Path, ledger: int, line: bytes, text: str | None) -> None:
    """Append a line to the ledger, with another study's file where there is a `text`.

    Args:
        folder: the study's, locked.
        ledger: descriptor of its ledger.
        line: with its newline.
        text: what `study.toml` is to say.
    """
    _drop_torn_line(ledger)
    if text is not None:
        write_through(folder / NEW, text)
    os.write(ledger, line)
    os.fsync(ledger)
    if text is not None:
        (folder / NEW).replace(folder / FILE)


def settle(folder: Path) -> None:
    """End a change that was cut off between the ledger and the study's file, or drop it."""
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
    """SHA-256 of the study's file as the ledger's last line names it, empty where it does not."""
    lines = (folder / LEDGER).read_bytes().splitlines()
    try:
        return str(msgspec.json.decode(lines[-1]).get("study", "")) if lines else ""
    except msgspec.DecodeError:
        return ""


def _drop_torn_line(ledger: int) -> None:
    """Cut off a last line that was never ended."""
    size = os.fstat(ledger).st_size
    tail = os.pread(ledger, size, 0)
    whole = tail.rfind(b"\n") + 1
    if whole < size:
        os.ftruncate(ledger, whole)
