"""Atomic writing of files: after a kill at any moment a file is either old or new."""

import os
from pathlib import Path

from rigwatch.wire.new_file import part_of, remove_left_behind


def write_through(path: Path, text: str) -> None:
    """Write a text file and return once it is on the disk."""
    with path.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


def replace_file(
    path: Path, content: str | bytes, *, mode: int = 0o666, durable: bool = True
) -> None:
    """Write a file completely or not at all.

    Args:
        path: the file, replaced if it exists.
        content: text, written as UTF-8, or bytes.
        mode: permissions of the file, limited by the process's umask.
        durable: return only once the file is on the disk.
    """
    part = part_of(path)
    remove_left_behind(path)
    # Created here with its final permissions, so that a secret is never readable by others.
    handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
