"""Recordings of an object store as units of a job: fetched while they are worked on.

address ─▶ addresses of its sessions ─▶ worker: copy ─▶ job ─▶ result that names the address
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import msgspec

from rigwatch.archive.entry import Entry, entries
from rigwatch.archive.indexing import outside_index
from rigwatch.archive.store import Store
from rigwatch.batch import content_hash, is_address
from rigwatch.wire.errors import ArchiveError, RigwatchError
from rigwatch.wire.session import SUFFIX, is_segment
from rigwatch.wire.typed_files import as_json


def sessions_at(address: str) -> list[str]:
    """Addresses of the sessions at an address: one session, a folder of them, or a glob.

    Raises:
        ArchiveError: it cannot be reached, or has no session.
    """
    if _is_pattern(address):
        return _matching(address)
    if address.endswith(SUFFIX):
        return [address]
    store = Store(address)
    files = outside_index(store)
    if any(is_segment(PurePosixPath(file.name)) and "/" not in file.name for file in files):
        return [store.url]
    return _some(address, [f"{store.url}/{entry.name}" for entry in entries(files)])


def _matching(pattern: str) -> list[str]:
    """Sessions whose name, or that of one of their files, a pattern matches."""
    parts = pattern.split("/")
    first = next(place for place, part in enumerate(parts) if _is_pattern(part))
    store = Store("/".join(parts[:first]))
    wanted = set(store.glob("/".join(parts[first:])))
    found = entries(outside_index(store))
    hit = (e for e in found if {e.name, *(file.name for file in e.files)} & wanted)
    return _some(pattern, [f"{store.url}/{entry.name}" for entry in hit])


def _some(address: str, found: list[str]) -> list[str]:
    if not found:
        raise ArchiveError(f"{address}: found no session, expected at least one")
    return found


def _is_pattern(text: str) -> bool:
    return any(mark in text for mark in "*?[")


def _entry(address: str) -> tuple[Store, Entry]:
    """The store above a session, and its files.

    Raises:
        ArchiveError: there is none.
    """
    head, _, name = address.rstrip("/").rpartition("/")
    store = Store(head)
    files = tuple(file for file in store.listed(name) if file.name.endswith(SUFFIX))
    if not files:
        raise ArchiveError(f"{address}: found no session, expected one")
    return store, Entry(name, files)


@contextmanager
def _fetched(address: str) -> Iterator[tuple[Path, str, str]]:
    """A copy of a session; the folder of the copies, and the address that it was copied from."""
    store, entry = _entry(address)
    with store.local([file.name for file in entry.files]) as paths:
        folder = paths[0].parent
        if address.endswith(SUFFIX):
            yield paths[0], str(folder), store.url
        else:
            yield folder, str(folder), address


@dataclass(frozen=True)
class Anywhere:
    """A job's function for recordings that lie in a folder or in an object store.

    Results and errors name a recording's address, not that of its copy.

    Attributes:
        call: called with the path of a recording, or of its copy.
    """

    call: Callable[..., Any]

    def __call__(self, place: str, **settings: Any) -> Any:
        """The result for a recording at a path or an address."""
        if not is_address(place):
            return self.call(Path(place), **settings)
        with _fetched(place) as (path, folder, stands_for):
            try:
                value = as_json(self.call(path, **settings), sort_keys=True)
            except RigwatchError as error:
                error.args = (str(error).replace(folder, stands_for),)
                raise
        name = msgspec.json.encode(stands_for)[1:-1]
        return msgspec.Raw(value.replace(folder.encode(), name))


def content_anywhere(place: str) -> str:
    """Hash of a recording's content; in an object store, what changes with it."""
    return _entry(place)[1].stamp if is_address(place) else content_hash(Path(place))
