"""The catalogue of an archive in memory: rows of sessions, alarms and losses, read and written."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rigwatch.archive.entry import DUPLICATE, THINNED, UNREADABLE
from rigwatch.archive.layout import ALARMS, INDEX, LOSSES, SECONDS, SESSIONS
from rigwatch.archive.one_writer import other_writer
from rigwatch.archive.store import Store
from rigwatch.archive.tables import (
    ALARM_COLUMNS,
    LOSS_COLUMNS,
    SESSION_COLUMNS,
    read_rows,
    write_rows,
)

FAILED = "failed"
"""Status of a session that was not read for a reason outside of it; it is read again next time."""
Row = dict[str, Any]


@dataclass(slots=True)
class Catalogue:
    """The rows of the three tables, sessions by their names.

    Attributes:
        stamp: of the stored table of sessions when it was read or written last.
    """

    sessions: dict[str, Row]
    alarms: list[Row]
    losses: list[Row]
    stamp: str = ""

    def forget(self, names: set[str]) -> None:
        """Remove sessions with their alarms and losses."""
        self.sessions = {name: row for name, row in self.sessions.items() if name not in names}
        self.alarms = _without(self.alarms, names)
        self.losses = _without(self.losses, names)

    def add(self, row: Row) -> None:
        """Add what was read of one session."""
        about = {"session": row["session"], "rig": row.get("rig")}
        self.alarms += [about | _timed(alarm) for alarm in row.pop("alarm_rows", ())]
        self.losses += [about | _timed(loss) for loss in row.pop("loss_rows", ())]
        start, row["end"] = _microseconds(row, "start_ns"), _microseconds(row, "end_ns")
        # A log without a date begins at 0; where nothing was recorded, both are 0.
        row["start"] = 0 if start is None and row["end"] is not None else start
        self.sessions[row["session"]] = row

    def mark_copies(self) -> None:
        """Of sessions with the same content the first counts, the others are copies."""
        first: dict[str, str] = {}
        copies = set()
        for name in sorted(self.sessions):
            row = self.sessions[name]
            if row["status"] in (UNREADABLE, FAILED):
                continue
            original = first.setdefault(row["content"], name)
            if original != name:
                row |= {"status": DUPLICATE, "remark": f"is a copy of {original}"}
                copies.add(name)
        self.alarms, self.losses = _without(self.alarms, copies), _without(self.losses, copies)

    def still_right(self, stamps: dict[str, str]) -> set[str]:
        """Sessions whose rows hold, given the present stamps: same files, and read last time.

        A copy holds only while its original does.
        """
        same = {
            name: row
            for name, row in self.sessions.items()
            if stamps.get(name) == row["stamp"] and row["status"] != FAILED
        }
        originals = {row["content"] for row in same.values() if row["status"] != DUPLICATE}
        return {
            name
            for name, row in same.items()
            if row["status"] != DUPLICATE or row["content"] in originals
        }

    def with_recording(self) -> set[str]:
        """Sessions of which more than the figures per second should be there."""
        return {name for name, row in self.sessions.items() if row["status"] != THINNED}

    def files(self) -> set[str]:
        """Names of all files of figures per second."""
        return {name for row in self.sessions.values() for name in row.get("files") or ()}


def load(store: Store) -> Catalogue:
    """The catalogue as it is stored; empty if there is none."""
    there = _stamps(store)
    sessions, alarms, losses = (
        _read(store, name) if name in there else [] for name in (SESSIONS, ALARMS, LOSSES)
    )
    by_name = {row["session"]: row for row in sessions}
    return Catalogue(by_name, alarms, losses, there.get(SESSIONS, ""))


def _stamps(store: Store) -> dict[str, str]:
    """What changes with each table that is stored."""
    listed = store.listed(INDEX)
    return {file.name: file.stamp for file in listed if not file.name.startswith(SECONDS)}


def _read(store: Store, name: str) -> list[Row]:
    with store.local([name]) as (path,):
        return read_rows(path)


def save(store: Store, kept: Catalogue) -> None:
    """Write the tables; sessions last, as they say what the others hold.

    Raises:
        ArchiveError: another process has written an object store's, or they cannot be written.
    """
    if not store.is_local and _stamps(store).get(SESSIONS, "") != kept.stamp:
        raise other_writer(store)
    sessions = [kept.sessions[name] for name in sorted(kept.sessions)]
    alarms, losses = (sorted(rows, key=_order) for rows in (kept.alarms, kept.losses))
    tables = (
        (ALARMS, ALARM_COLUMNS, alarms),
        (LOSSES, LOSS_COLUMNS, losses),
        (SESSIONS, SESSION_COLUMNS, sessions),
    )
    with TemporaryDirectory(prefix="rigwatch-") as folder:
        file = Path(folder, "table")
        for name, columns, rows in tables:
            write_rows(file, columns, rows)
            store.put(file, name)
    kept.stamp = "" if store.is_local else _stamps(store).get(SESSIONS, "")


def _without(rows: Iterable[Row], names: set[str]) -> list[Row]:
    return [row for row in rows if row["session"] not in names]


def _order(row: Row) -> str:
    return str(row["session"])  # within a session they are in their order


def _timed(row: Row) -> Row:
    return row | {"time": _microseconds(row, "t_ns")}


def _microseconds(row: Row, name: str) -> int | None:
    value = row.get(name)
    return value // 1000 if value else None
