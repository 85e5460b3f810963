"""Removes old sessions of an archive, by the rules that the recorder has for its own.

Only sessions that match the catalogue are removed: one that is new, has changed, is still being
recorded or could not be read stays. So does one whose age is unknown, such as a log that was
imported without the time of its start.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import groupby

from rigwatch.archive.catalogue import FAILED, Catalogue, Row, load, save
from rigwatch.archive.entry import THINNED, UNFINISHED, UNREADABLE, Entry, entries
from rigwatch.archive.indexing import outside_index, remove_unused
from rigwatch.archive.one_writer import one_writer
from rigwatch.archive.retention.thinning import finish_thinning, thin
from rigwatch.archive.store import Store
from rigwatch.recorder import POSITIONS, expired
from rigwatch.wire.errors import ArchiveError, SessionError
from rigwatch.wire.rig_config import RecorderSection

_STAYS = (UNFINISHED, UNREADABLE, FAILED)
_DATED = datetime(2000, 1, 1, tzinfo=UTC).timestamp()
"""Earliest end of a session that is a date [s]: imported logs may begin at zero, in 1970."""


@dataclass(frozen=True, slots=True)
class Old:
    """A session of the archive: its end as Unix time [s], size [bytes], whether it has alarms."""

    session: str
    rig: str
    ended: float
    size: int
    alarms: bool


@dataclass(slots=True)
class Retained:
    """What the rules say, and what was done.

    Attributes:
        sessions: number in the catalogue before.
        expired: sessions that the rules remove, oldest first.
        removed: number of sessions that are removed, those of a run that was stopped included.
        unknown: sessions that stay because they are new or have changed since the last index.
        undated: sessions that stay because they do not tell when they were recorded.
        failures: a sentence on each that cannot be removed.
    """

    sessions: int = 0
    expired: list[Old] = field(default_factory=list)
    removed: int = 0
    unknown: list[str] = field(default_factory=list)
    undated: list[str] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)


def retain(
    store: Store,
    rules: RecorderSection,
    *,
    rig: str | None = None,
    now: datetime | None = None,
    remove: bool = False,
    keep_seconds: bool = False,
    only: str = "",
    say: Callable[[str], None] = lambda _: None,
) -> Retained:
    """Find the sessions that rules remove from an archive, rig by rig, and remove them if wanted.

    Args:
        store: the archive, with an index.
        rules: `keep_days`, `keep_alarm_days` and `keep_gigabytes` (of each rig); 0 for no limit.
        rig: only this one.
        now: present time; by default the clock's.
        remove: remove the files; otherwise only find them.
        keep_seconds: keep the row, figures per second, alarms and losses of what is removed.
        only: this session alone, which may be one that was cut off; "" for all.
        say: called with progress.

    Raises:
        ArchiveError: there is no index, or the archive cannot be read or written.
    """
    store.check()
    now_s = (now or datetime.now(UTC)).timestamp()
    if not remove:
        return _found(store, _catalogue(store), rules, rig, now_s, only=only)
    with one_writer(store):
        kept = _catalogue(store)
        finished = finish_thinning(store, kept, outside_index(store))
        done = _found(store, kept, rules, rig, now_s, only=only)
        if done.expired:
            found = {entry.name: entry for entry in entries(outside_index(store))}
            if keep_seconds:
                _thin(store, kept, found, done)
            _remove(store, kept, found, done, say)
        done.removed += finished
    return done


def _catalogue(store: Store) -> Catalogue:
    kept = load(store)
    if not kept.sessions:
        raise ArchiveError(f"{store.url}: has no index, make one with rigwatch archive index")
    return kept


def _found(
    store: Store,
    kept: Catalogue,
    rules: RecorderSection,
    rig: str | None,
    now_s: float,
    *,
    only: str,
) -> Retained:
    """What the rules say of the sessions that are there as the catalogue knows them."""
    found = {entry.name: entry for entry in entries(outside_index(store))}
    known = [row for name, row in kept.sessions.items() if _is_same(found.get(name), row)]
    done = Retained(len(kept.sessions), unknown=sorted(set(found) - {r["session"] for r in known}))
    if only:
        known = [row for row in known if row["session"] == only]
    olds = (old_of(row, cut_off=bool(only)) for row in known)
    old = sorted((o for o in olds if o and rig in (None, o.rig)), key=lambda o: o.rig)
    done.undated = sorted(one.session for one in old if one.ended < _DATED)
    old = [one for one in old if one.ended >= _DATED]
    for _, of_rig in groupby(old, key=lambda one: one.rig):
        done.expired += expired(of_rig, rules, now_s)
    return done


def _is_same(entry: Entry | None, row: Row) -> bool:
    return entry is not None and entry.stamp == row["stamp"]


def old_of(row: Row, *, cut_off: bool = False) -> Old | None:
    """A session that may be removed; one that is damaged may hide an alarm.

    Args:
        row: of the catalogue.
        cut_off: an unfinished session is not recorded any more.
    """
    stays = row["status"] in _STAYS and not (cut_off and row["status"] == UNFINISHED)
    if stays or row["end"] is None:
        return None
    ended = row["end"].replace(tzinfo=UTC).timestamp()
    alarms = bool(row["raised"]) or bool(row["damaged_bytes"])
    return Old(row["session"], row["rig"], ended, row["bytes"], alarms)


def _thin(store: Store, kept: Catalogue, found: dict[str, Entry], done: Retained) -> None:
    """Figures first: a recording goes only once the catalogue holds what stays of it."""
    for one in tuple(done.expired):
        try:
            thin(store, found[one.session], kept.sessions[one.session])
        except (ArchiveError, SessionError) as error:
            done.expired.remove(one)
            done.failures.append(f"{one.session}: {error}")
    save(store, kept)


def _remove(
    store: Store,
    kept: Catalogue,
    found: dict[str, Entry],
    done: Retained,
    say: Callable[[str], None],
) -> None:
    """Files first: a catalogue that lags behind is mended by the next index."""
    gone = set()
    for one in done.expired:
        failure = next(_failures(store, found[one.session]), None)
        if failure is None:
            gone.add(one.session)
        else:
            done.failures.append(f"{one.session}: {failure}")
    kept.forget({name for name in gone if kept.sessions[name]["status"] != THINNED})
    for name in gone & set(kept.sessions):
        kept.sessions[name]["going"] = None
    save(store, kept)
    remove_unused(store, kept)
    done.removed = len(gone)
    say(f"{len(gone)} of {len(done.expired)} sessions removed")


def _failures(store: Store, entry: Entry) -> Iterator[str]:
    """Remove the files of an entry; why one of them cannot be removed."""
    in_folder = entry.name != entry.files[0].name
    beside = [f"{entry.name}/{name}" for name in POSITIONS if in_folder]
    for name in [*beside, *(file.name for file in entry.files)]:
        try:
            store.remove(name)
        except (ArchiveError, OSError) as error:
            yield str(error)
