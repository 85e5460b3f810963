"""A study's folder: file and ledger change atomically, even if the process is killed.

A change is written as `study.new`, own effect and model files as `NAME.toml.new`; then its line
with the new files' SHA-256 is appended to the ledger, then the new files replace the old ones.
After a kill in between, the next opening completes the change if the ledger records it and discards
it otherwise.
"""

import fcntl
import hashlib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rigwatch.wire.host import write_through
from rigwatch.wire.typed_files import JsonError, json_value

FILE = "study.toml"
LEDGER = "ledger.jsonl"
NEW = "study.new"
STAGED = ".new"


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


def write_step(
    folder: Path, ledger: int, line: bytes, text: str | None, files: Mapping[str, str]
) -> None:
    """Append a line to the ledger and, given a `text`, replace the study's file.

    Args:
        folder: the study's folder, locked.
        ledger: descriptor of its ledger.
        line: the line including its newline.
        text: new content of `study.toml`.
        files: new content of own files, by name; only with a `text`.
    """
    _drop_torn_line(ledger)
    if text is not None:
        write_through(folder / NEW, text)
        for name, content in files.items():
            write_through(folder / f"{name}{STAGED}", content)
    os.write(ledger, line)
    os.fsync(ledger)
    if text is not None:
        for name in files:
            (folder / f"{name}{STAGED}").replace(folder / name)
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
        last = _last_line(folder)
        known = last.get("files", {})
        # The study's own file is the last, so that it never names a file that is not there yet.
        for staged in folder.glob(f"*.toml{STAGED}"):
            name = staged.name.removesuffix(STAGED)
            _complete_or_discard(staged, folder / name, known.get(name, ""))
        _complete_or_discard(new, folder / FILE, last.get("study", ""))


def _complete_or_discard(new: Path, file: Path, recorded: str) -> None:
    """Put a file in place if its SHA-256 is the recorded one, otherwise remove it."""
    if hashlib.sha256(new.read_bytes()).hexdigest() == recorded:
        new.replace(file)
    else:
        new.unlink()


def _last_line(folder: Path) -> dict[str, Any]:
    """The ledger's last line; empty if there is none."""
    lines = (folder / LEDGER).read_bytes().splitlines()
    try:
        return json_value(lines[-1], dict[str, Any]) if lines else {}
    except JsonError:
        return {}


def _drop_torn_line(ledger: int) -> None:
    """Truncate an incomplete last line."""
    size = os.fstat(ledger).st_size
    tail = os.pread(ledger, size, 0)
    whole = tail.rfind(b"\n") + 1
    if whole < size:
        os.ftruncate(ledger, whole)
