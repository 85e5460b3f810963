"""Removes old segments by age and total size; segments with alarms stay longer.

A closed segment states in its summary how many alarms it holds. One that does not (still open, or
its recorder was killed) counts as one with alarms. The size stays within its limit between two
checks too: each leaves room for as much as was recorded since the last one.

A segment that was written while the clock was plainly wrong, as in 1970, is as old as the newest
other one of its session; one of a session without others is never too old.
"""

import contextlib
import math
import os
import sys
from array import array
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rigwatch.recorder.positions import FILES
from rigwatch.recorder.retention.age_clock import EARLIEST_NS
from rigwatch.recorder.retention.rules import Facts, places_expired
from rigwatch.recorder.session_list import sessions_of
from rigwatch.wire.messages import ALARMS, Event
from rigwatch.wire.rig_config import RecorderSection
from rigwatch.wire.session import SUFFIX, topic_counts

EVERY = 60.0
"""Time between checks of the folder [s]."""


@dataclass(frozen=True, slots=True)
class Segment:
    """A segment on the disk: folder, name, size [bytes]."""

    folder: str
    name: str
    size: int

    @property
    def path(self) -> Path:
        """Its file."""
        return Path(self.folder, self.name)


@dataclass
class _Listing:
    """Closed segments, a column for each fact: years have thousands.

    Attributes:
        folders: with the number of the first segment of each, and of the one after its last.
        names: of the segments.
        ended: their ends as Unix time [ns].
        size: theirs [bytes].
        alarms: whether each has some.
    """

    folders: list[tuple[str, int, int]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    ended: "array[int]" = field(default_factory=lambda: array("q"))
    size: "array[int]" = field(default_factory=lambda: array("q"))
    alarms: bytearray = field(default_factory=bytearray)

    @property
    def facts(self) -> Facts:
        """What decides."""
        return Facts(
            np.array(self.ended) / 1e9, np.array(self.size), np.array(self.alarms, np.bool_)
        )

    def size_in(self, folder: str) -> int:
        """Size of the segments in a folder [bytes]."""
        return sum(sum(self.size[first:end]) for one, first, end in self.folders if one == folder)

    def segments(self, places: Iterable[int]) -> list[Segment]:
        """The segments at these places."""
        firsts = [first for _, first, _ in self.folders]
        return [
            Segment(
                self.folders[bisect_right(firsts, place) - 1][0],
                self.names[place],
                self.size[place],
            )
            for place in places
        ]


class Retention:
    """The rules of one rig.

    Args:
        settings: section [recorder]; a limit of 0 disables it.
        rig: the rig whose sessions are managed.
    """

    def __init__(self, settings: RecorderSection, rig: str) -> None:
        self._settings, self._rig = settings, rig
        self._alarms: dict[str, dict[str, bool]] = {}
        self._due = 0.0
        self._left = math.inf

    def update(self, now: float, t_ns: int, current: Path) -> list[Event]:
        """Remove expired segments, at most once a minute, and report them.

        Args:
            now: monotonic time [s].
            t_ns: Unix time by which ages count [ns].
            current: folder being recorded to; its newest segment is kept.
        """
        if now < self._due:
            return []
        self._due = now + EVERY
        removed = [one for one in self.expired(t_ns / 1e9, current) if _remove(one.path)]
        if not removed:
            return []
        size = sum(one.size for one in removed) / 1e6
        text = f"{len(removed)} segment(s) removed, {size:.1f} MB: older or larger than configured"
        return [Event("recorder", t_ns, "info", "RECORDING_EXPIRED", text)]

    def expired(self, now_s: float, current: Path) -> list[Segment]:
        """Segments to be removed, oldest first, those without alarms before those with alarms."""
        newest = _newest(current)
        kept = _size(newest) if newest else 0
        found = self._listed(newest, now_s)
        size = kept + found.size_in(str(current))
        room = int(max(0.0, size - self._left))
        gone = found.segments(places_expired(found.facts, self._settings, now_s, kept + room))
        self._left = size - sum(one.size for one in gone if one.folder == str(current))
        return gone

    def _listed(self, newest: Path | None, now_s: float) -> _Listing:
        """The segments of the rig but the newest, which is being written."""
        found = _Listing()
        for path in sessions_of(Path(self._settings.folder), self._rig):
            first = len(found.names)
            going_on_ns = _list_segments(path, newest, found)
            found.folders.append((str(path), first, len(found.names)))
            _date(found.ended, first, going_on_ns, round(now_s * 1e9))
            found.alarms += bytes(self._have_alarms(path, found.names[first:]))
        for gone in self._alarms.keys() - {folder for folder, *_ in found.folders}:
            del self._alarms[gone]  # others remove segments too
        return found

    def _have_alarms(self, folder: Path, names: Sequence[str]) -> Iterator[bool]:
        """Whether each of a folder's segments has alarms; what is known of others is forgotten."""
        known = self._alarms.setdefault(str(folder), {})
        for name in names:
            if name not in known:
                known[name] = _has_alarms(folder / name)
            yield known[name]
        if len(known) > len(names):
            for name in known.keys() - {*names}:
                del known[name]
        if not known:
            del self._alarms[str(folder)]


def _has_alarms(path: Path) -> bool:
    counts = topic_counts(path)
    return counts is None or counts.get(ALARMS.name, 0) > 0


def _remove(path: Path) -> bool:
    """Remove a segment, and its folder with the last one; False if that is not possible."""
    try:
        path.unlink()
        if not any(_names(path.parent)):
            for name in FILES:
                (path.parent / name).unlink(missing_ok=True)
            path.parent.rmdir()
    except OSError:
        return not path.exists()
    return True


def _list_segments(folder: Path, newest: Path | None, into: _Listing) -> int:
    """Add name, time and size of a session's segments; not of those that are removed meanwhile.

    Returns:
        Time of the newest, which is being written and not added [ns]; 0 if it is elsewhere.
    """
    being_written = newest.name if newest is not None and newest.parent == folder else ""
    its_time = 0
    with contextlib.suppress(OSError), os.scandir(folder) as found:
        for entry in found:
            if not entry.name.endswith(SUFFIX):
                continue
            with contextlib.suppress(OSError):
                seen = entry.stat()
                if entry.name == being_written:
                    its_time = seen.st_mtime_ns
                    continue
                into.names.append(sys.intern(entry.name))
                into.ended.append(seen.st_mtime_ns)
                into.size.append(seen.st_size)
    return its_time


def _date(ended: "array[int]", first: int, newest_ns: int, now_ns: int) -> None:
    """Date what a wrong clock has written, from the first one on, like the newest of the session.

    Args:
        ended: ends of the segments [ns], changed.
        first: place of the session's first one.
        newest_ns: time of the one that is being written [ns].
        now_ns: time of those of a session in which all clocks were wrong [ns].
    """
    wrong = [at for at in range(first, len(ended)) if ended[at] < EARLIEST_NS]
    newest = max([newest_ns, *ended[first:]]) if wrong else 0
    for place in wrong:
        ended[place] = newest if newest >= EARLIEST_NS else now_ns


def _newest(current: Path) -> Path | None:
    """The segment that is being written."""
    name = max(_names(current), default="")
    return current / name if name else None


def _names(folder: Path) -> Iterator[str]:
    """The names of a session's segments; a year has thousands: `Path.glob` lists them first."""
    with contextlib.suppress(OSError), os.scandir(folder) as found:
        for entry in found:
            if entry.name.endswith(SUFFIX):
                yield entry.name


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0
