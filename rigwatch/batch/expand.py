"""Paths, globs and folders as recordings or studies."""

import glob
import os
from collections.abc import Callable, Iterable, Iterator
from operator import attrgetter
from pathlib import Path

from rigwatch.wire.errors import BatchError
from rigwatch.wire.session import SUFFIX, names_segment

Finder = Callable[[Path], list[Path]]


def recording_at(folder: Path) -> list[Path]:
    """The recordings in a folder, at any depth: session files, and folders of segments."""
    top = _listed(str(folder))
    if any(names_segment(entry.name) for entry in top):
        return [folder]
    return [Path(name) for name in dict.fromkeys(_recordings(str(folder), top))]


def _listed(folder: str) -> "list[os.DirEntry[str]]":
    """What a folder holds, in the order of names; nothing if it may not be read.

    Workers wait for the listing, and `Path.rglob` takes five times as long for ten thousand files.
    """
    try:
        with os.scandir(folder) as found:
            return sorted(found, key=attrgetter("name"))
    except PermissionError:
        return []


def _recordings(folder: str, held: "list[os.DirEntry[str]]") -> Iterator[str]:
    """The recording that each session file belongs to; links to folders are not followed."""
    for entry in held:
        if entry.name.endswith(SUFFIX):
            yield folder if names_segment(entry.name) else entry.path
        if entry.is_dir(follow_symlinks=False):
            yield from _recordings(entry.path, _listed(entry.path))


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
        BatchError: a path does not exist, a glob or a folder holds nothing, or a name is not UTF-8.
    """
    found: dict[str, str] = {}
    resolved: dict[str, str] = {}
    for text in map(str, given):
        if is_address(text):
            found[text] = text
            continue
        for path in _paths(text):
            for unit in map(str, inside(path) if path.is_dir() else [path]):
                found.setdefault(_resolved(unit, resolved), unit)
    if not found:
        names = ", ".join(map(str, given)) or "no path"
        raise BatchError(f"{names}: found nothing to work on, expected recordings or studies")
    for unit in found.values():
        _check_name(unit)
    return sorted(found.values())


def _check_name(unit: str) -> None:
    """Raise if no file of results can hold the unit's path."""
    try:
        unit.encode()
    except UnicodeEncodeError:
        raise BatchError(f"{unit}: found a name that is not UTF-8, expected one that is") from None


def _resolved(unit: str, folders: dict[str, str]) -> str:
    """The unit's path without links; folders are resolved once, and kept in `folders`."""
    folder, name = os.path.split(unit)
    if name in ("", "..") or os.path.islink(unit):  # noqa: PTH114
        return os.path.realpath(unit)
    if folder not in folders:
        folders[folder] = os.path.realpath(folder).rstrip("/")
    return f"{folders[folder]}/{name}"


def _paths(text: str) -> list[Path]:
    if Path(text).exists():
        return [Path(text)]
    if not glob.has_magic(text):
        raise BatchError(f"{text}: no such file or folder")
    return [Path(name) for name in sorted(glob.glob(text, recursive=True))]  # noqa: PTH207
