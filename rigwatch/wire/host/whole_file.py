"""Atomic writing of files: after a kill at any moment a file is either old or new."""

import os
from pathlib import Path


def write_through(path: Path, text: str) -> None:
    """Write a text file and return once it is on the disk."""
    with path.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


def replace_file(path: Path, text: str) -> None:
    """Write a text file completely or not at all."""
    beside = path.with_name(f"{path.name}.{os.getpid()}.part")
    write_through(beside, text)
    beside.replace(path)
