"""Brings the index of an archive up to date: reads what is new or changed, forgets what is gone.

The catalogue is written after each batch, so that an index that was stopped continues there.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import msgspec

from rigwatch.archive.catalogue import FAILED, Catalogue, Row, load, save
from rigwatch.archive.entry import Entry, catalogued, entries
from rigwatch.archive.layout import INDEX, SECONDS
from rigwatch.archive.one_writer import one_writer
from rigwatch.archive.retention.thinning import finish_thinning
from rigwatch.archive.store import Store, Stored
from rigwatch.archive.tables import pyarrow
from rigwatch.batch import Job, Outcome, map_units
from rigwatch.wire.typed_files import json_decoder

BATCH = 500
"""Sessions between two writings of the catalogue."""
Say = Callable[[str], None]
Workers = Executor | Callable[[], Executor] | None
_ENTRIES = json_decoder(Entry)


@dataclass(slots=True)
class Indexed:
    """What an index did.

    Attributes:
        sessions: number in the catalogue.
        read: number read because they are new or have changed.
        removed: number forgotten because they are gone.
        statuses: number of sessions by status.
        remarks: a sentence on each session that is not ok.
    """

    sessions: int = 0
    read: int = 0
    removed: int = 0
    statuses: dict[str, int] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def index(
    store: Store,
    *,
    executor: Workers = None,
    say: Say = lambda _: None,
    batch: int = BATCH,
    only: Collection[str] | None = None,
) -> Indexed:
    """Bring the index of an archive up to date.

    Args:
        store: the archive.
        executor: reads sessions; None reads them in this process.
        say: called with progress.
        batch: sessions between two writings of the catalogue.
        only: of what is new or has changed, read these alone.

    Raises:
        ArchiveError: the archive cannot be read or written.
        BatchError: the executor's workers are gone.
        MissingExtraError: pyarrow is not installed.
    """
    pyarrow()
    store.check()
    with one_writer(store):
        return _indexed(store, executor, say, batch, only)


def _indexed(
    store: Store, executor: Workers, say: Say, batch: int, only: Collection[str] | None
) -> Indexed:
    kept = load(store)
    finish_thinning(store, kept, outside_index(store))
    found = {entry.name: entry for entry in entries(outside_index(store))}
    due = sorted(set(found) - kept.still_right({name: e.stamp for name, e in found.items()}))
    due = due if only is None else [name for name in due if name in only]
    gone = kept.with_recording() - set(found)
    kept.forget(gone | set(due))
    for start in range(0, max(1, len(due)), batch):
        part = [found[name] for name in due[start : start + batch]]
        for row in _read(store, part, executor, say):
            kept.add(row)
        kept.mark_copies()
        save(store, kept)
        if len(due) > batch:
            say(f"{start + len(part)} of {len(due)} sessions are in the catalogue")
    remove_unused(store, kept)
    return _summary(kept, len(due), len(gone))


def outside_index(store: Store) -> list[Stored]:
    """All files of an archive but those of its index."""
    return [file for file in store.listed() if not file.name.startswith(f"{INDEX}/")]


def _read(store: Store, part: list[Entry], executor: Workers, say: Say) -> Iterator[Row]:
    """A row of each entry."""
    units = {msgspec.json.encode(entry).decode(): entry for entry in part}
    settings = {"url": store.url, "options": store.options}
    done = map_units(_JOB, sorted(units), settings, executor=executor, say=say)
    for outcome in done.outcomes():
        yield _row(outcome, units[outcome.path])


def _row(outcome: Outcome, entry: Entry) -> Row:
    if not outcome.failed:
        row: Row = msgspec.json.decode(outcome.value)
        return row
    remark = outcome.error.replace(f"{outcome.path}: ", "")
    return {"session": entry.name, "status": FAILED, "remark": remark, "stamp": entry.stamp}


def read_entry(entry: Entry, url: str, options: dict[str, Any]) -> Row:
    """What a worker does: the row of an entry."""
    return catalogued(Store(url, options), entry)


def _stamp(entry: Entry) -> str:
    return entry.stamp


def _entry(text: str) -> Entry:
    return _ENTRIES.decode(text)


_JOB = Job("archive index", read_entry, content=_stamp, unit=_entry)


def remove_unused(store: Store, kept: Catalogue) -> None:
    """Remove figures per second of sessions that are gone, or were read and not catalogued."""
    used = kept.files()
    for file in store.listed(SECONDS):
        if file.name not in used:
            store.remove(file.name)


def _summary(kept: Catalogue, read: int, removed: int) -> Indexed:
    rows = [kept.sessions[name] for name in sorted(kept.sessions)]
    return Indexed(
        len(rows),
        read,
        removed,
        dict(sorted(Counter(row["status"] for row in rows).items())),
        [f"{row['session']}: {row['remark']}" for row in rows if row["remark"]],
    )
