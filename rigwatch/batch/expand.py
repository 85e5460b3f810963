"""Paths, globs and folders as recordings or studies."""

import glob
import os
from collections.abc import Callable, Iterable
from operator import attrgetter
from pathlib import Path

from rigwatch.wire.errors import BatchError
from rigwatch.wire.session import SUFFIX, is_segment

Finder = Callable[[Path], list[Path]]


def recording_at(folder: Path) -> list[Path]:
    """The recordings in a folder, at any depth: session files, and folders of segments."""
    if is_segmented(folder):
        return [folder]
    found: dict[Path, None] = {}
    # Ten thousand paths are in order in half the time by their parts, which is the same order.
    for file in sorted(folder.rglob(f"*{SUFFIX}"), key=attrgetter("parts")):
        whole = file.parent if is_segment(file) else file
        found[whole] = None
    return list(found)


def is_segmented(folder: Path) -> bool:
    """Whether a folder is one session, written by a recorder in segments."""
    return any(is_segment(file) for file in folder.glob(f"*{SUFFIX}"))


def is_address(text: str) -> bool:
    """Whether a unit lies in an object store, such as "s3://bucket/run.mcap"."""
    return "://" in text


def expand(given: Iterable[Path | str], inside: Finder = recording_at) -> list[str]:
    """The units named by paths, globs and folders: each once, in order of their names.

    Args:
        given: paths of units or of folders with units in them, and globs (`**` for any depth);
            the address of a unit in an object store stands for itself.
        inside: units of a folder.

    Raises:
        BatchError: a path does not exist, or a glob or a folder holds nothing.
    """
    found: dict[str, str] = {}
    resolved: dict[str, str] = {}
    for text in map(str, given):
        if is_address(text):
            found[text] = text
            continue
        for path in _paths(text):
            for unit in inside(path) if path.is_dir() else [path]:
                found.setdefault(_resolved(unit, resolved), str(unit))
    if not found:
        names = ", ".join(map(str, given)) or "no path"
        raise BatchError(f"{names}: found nothing to work on, expected recordings or studies")
    return sorted(found.values())


def _resolved(unit: Path, folders: dict[str, str]) -> str:
    """The unit's path without links; folders are resolved once, and kept in `folders`."""
    if unit.is_symlink() or unit.name in ("", ".."):
        return str(unit.resolve())
    folder, name = os.path.split(unit)
    if folder not in folders:
        folders[folder] = os.path.realpath(folder).rstrip("/")
    return f"{folders[folder]}/{name}"


def _paths(text: str) -> list[Path]:
    if Path(text).exists():
        return [Path(text)]
    if not glob.has_magic(text):
        raise BatchError(f"{text}: no such file or folder")
    return [Path(name) for name in sorted(glob.glob(text, recursive=True))]  # noqa: PTH207
