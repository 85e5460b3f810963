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
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rigwatch.recorder.positions import FILES
from rigwatch.recorder.retention.age_clock import EARLIEST_NS
from rigwatch.recorder.retention.rules import expired
from rigwatch.recorder.session_list import sessions_of
from rigwatch.wire.messages import ALARMS, Event
from rigwatch.wire.rig_config import RecorderSection
from rigwatch.wire.session import SUFFIX, topic_counts

EVERY = 60.0
"""Time between checks of the folder [s]."""


@dataclass(frozen=True, slots=True)
class Segment:
    """A segment on the disk: folder, name, end as Unix time [s], size [bytes], whether it has
    alarms.

    Years have thousands: the texts of folders and names are shared.
    """

    folder: str
    name: str
    ended: float
    size: int
    alarms: bool

    @property
    def path(self) -> Path:
        """Its file."""
        return Path(self.folder, self.name)


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
        found = list(self._segments(newest, now_s))
        size = kept + _size_in(current, found)
        room = int(max(0.0, size - self._left))
        gone = expired(found, self._settings, now_s, kept + room)
        self._left = size - _size_in(current, gone)
        return gone

    def _segments(self, newest: Path | None, now_s: float) -> Iterator[Segment]:
        before, self._alarms = self._alarms, {}  # others remove segments too
        for path in sessions_of(Path(self._settings.folder), self._rig):
            folder = str(path)
            found = list(_segments_in(folder))
            dated = (ended_ns for _, ended_ns, _ in found if ended_ns >= EARLIEST_NS)
            otherwise = max(dated, default=now_s * 1e9)
            known = before.get(folder, {})
            for name, ended_ns, size in found:
                if newest is not None and newest.name == name and newest.parent == path:
                    continue
                alarms = known[name] if name in known else _has_alarms(path / name)
                self._alarms.setdefault(folder, {})[name] = alarms
                ended = (ended_ns if ended_ns >= EARLIEST_NS else otherwise) / 1e9
                yield Segment(folder, name, ended, size, alarms)


def _has_alarms(path: Path) -> bool:
    counts = topic_counts(path)
    return counts is None or counts.get(ALARMS.name, 0) > 0


def _remove(path: Path) -> bool:
    """Remove a segment, and its folder with the last one; False if that is not possible."""
    try:
        path.unlink()
        if not any(path.parent.glob(f"*{SUFFIX}")):
            for name in FILES:
                (path.parent / name).unlink(missing_ok=True)
            path.parent.rmdir()
    except OSError:
        return not path.exists()
    return True


def _segments_in(folder: str) -> Iterator[tuple[str, int, int]]:
    """Name, time [ns] and size of a session's segments; not of those that are removed meanwhile."""
    with contextlib.suppress(OSError), os.scandir(folder) as found:
        for entry in found:
            if entry.name.endswith(SUFFIX):
                with contextlib.suppress(OSError):
                    seen = entry.stat()
                    yield sys.intern(entry.name), seen.st_mtime_ns, seen.st_size


def _newest(current: Path) -> Path | None:
    """The segment that is being written."""
    return max(current.glob(f"*{SUFFIX}"), default=None)


def _size_in(folder: Path, segments: list[Segment]) -> int:
    return sum(one.size for one in segments if one.folder == str(folder))


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0
