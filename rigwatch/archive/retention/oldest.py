"""Thins the sessions of a recorder, one at a time, while it records another.

    sessions of the rig, but the newest ─▶ the oldest that has expired ─▶ read into the catalogue ─▶
    figures per second of its samples stored ─▶ catalogue says `thinned` ─▶ its recording goes

A kill at any point loses nothing: the recording is whole until the catalogue holds what stays of
it, and what a kill leaves over is removed by the next run.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rigwatch.archive.catalogue import Catalogue, load
from rigwatch.archive.entry import Entry, entries
from rigwatch.archive.indexing import index, outside_index
from rigwatch.archive.one_writer import one_writer
from rigwatch.archive.retention.retain import old_of, retain
from rigwatch.archive.retention.thinning import finish_thinning
from rigwatch.archive.store import Store
from rigwatch.recorder import expired, newest, sessions_of
from rigwatch.wire.rig_config import RecorderSection

DAY_S = 86_400.0


@dataclass(frozen=True, slots=True)
class Thinned:
    """What was done.

    Attributes:
        session: the session that is thinned; "" if none has expired.
        size: of its recording, which is removed [bytes].
        failures: a sentence on each session that has expired and could not be thinned.
    """

    session: str
    size: int
    failures: tuple[str, ...]


def thin_oldest(
    folder: Path, rig: str, days: float, alarm_days: float, *, now: datetime | None = None
) -> Thinned:
    """Thin the oldest session of a rig that has expired, if there is one.

    The session that is recorded stays. One that was cut off, as by a kill of the recorder, counts
    as ended.

    Args:
        folder: of the recorder's sessions.
        rig: whose sessions.
        days: age at which sessions without alarms are thinned [days]; 0 for never.
        alarm_days: the same for sessions with alarms [days]; 0 for never.
        now: present time; by default the clock's.

    Raises:
        ArchiveError: the folder cannot be read or written, or another process writes its index.
        MissingExtraError: the packages of rigwatch[archive] are not installed.
        SessionError: the rig has no session.
    """
    store = Store(str(folder))
    store.check()
    _finish(store)
    now = now or datetime.now(UTC)
    rules = RecorderSection(keep_days=days, keep_alarm_days=alarm_days)
    current = newest(folder, rig).name
    own = {path.name for path in sessions_of(folder, rig)} - {current}
    found = [entry for entry in entries(outside_index(store)) if entry.name in own]
    failures = list[str]()
    for entry in sorted(found, key=lambda one: _written(folder, one)):
        # Its last file is as old as the session, or younger.
        if now.timestamp() - _written(folder, entry) < _soonest(days, alarm_days) * DAY_S:
            break
        if not _is_expired(entry, _known(store, entry), rules, now.timestamp()):
            continue
        done = retain(
            store, rules, rig=rig, now=now, remove=True, keep_seconds=True, only=entry.name
        )
        failures += done.failures
        if done.removed:
            return Thinned(entry.name, entry.size, tuple(failures))
    return Thinned("", 0, tuple(failures))


def _finish(store: Store) -> None:
    """Remove what a kill has left of a session that is thinned, if only its empty folder."""
    if any(row.get("going") for row in load(store).sessions.values()):
        with one_writer(store):
            finish_thinning(store, load(store), outside_index(store))


def _soonest(days: float, alarm_days: float) -> float:
    return min((one for one in (days, alarm_days) if one > 0), default=float("inf"))


def _written(folder: Path, entry: Entry) -> float:
    """When the last of its files was written, as Unix time [s]."""
    return max((folder / file.name).stat().st_mtime for file in entry.files)


def _known(store: Store, entry: Entry) -> Catalogue:
    """The catalogue with a session, which is read if it is not in it as it is."""
    kept = load(store)
    row = kept.sessions.get(entry.name)
    if row is not None and row["stamp"] == entry.stamp:
        return kept
    index(store, only={entry.name})
    return load(store)


def _is_expired(entry: Entry, kept: Catalogue, rules: RecorderSection, now_s: float) -> bool:
    old = old_of(kept.sessions[entry.name], cut_off=True)
    return old is not None and bool(expired([old], rules, now_s))
