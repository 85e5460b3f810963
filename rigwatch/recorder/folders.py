"""Chooses the folder of a recording: a new session, or the last one after a short interruption.

    <recorder.folder>/<rig>-20260501T120000Z/000001.mcap, 000002.mcap, …

A recorder that was killed and restarted continues in the same folder, or after a long interruption
in a new one, and queries the rings for what it missed. What they no longer have is a gap. After one
that was stopped on purpose, a new session begins with the samples from then on, unless the stop was
short: a recorder that is restarted with a changed configuration misses nothing.

`<recorder.folder>/.<rig>.last` names the session that was recorded last. File times alone do not
tell: a session recorded while the clock was years ahead would be the newest for years.
"""

import contextlib
import math
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from rigwatch.recorder.positions import Positions, load_positions
from rigwatch.recorder.session_list import sessions_of
from rigwatch.wire.errors import SessionError
from rigwatch.wire.host import replace_file
from rigwatch.wire.messages import SAMPLES, Block, RunInfo, Topic
from rigwatch.wire.session import SUFFIX, Session, open_session

LONGEST_BREAK = 120.0
"""Interruption after which a recorder starts a new session [s]."""
_SECOND_NS = 1_000_000_000
_FORMAT = "%Y%m%dT%H%M%SZ"


@dataclass(frozen=True, slots=True)
class Place:
    """The folder to record to, and its last messages.

    Attributes:
        last: (boot, seq) of the last sample recorded, None to begin with the next one.
        positions: the same for numbered messages.
        changed: they are those of a recording with another configuration.
    """

    folder: Path
    last: tuple[int, int] | None = None
    positions: Positions = field(default_factory=dict)
    changed: bool = False


def note_last(folder: Path, rig: str) -> None:
    """Note that `folder` is the session that is recorded now."""
    place = _last(folder.parent, rig)
    try:
        replace_file(place, folder.name, durable=False)
    except OSError:
        with contextlib.suppress(OSError):
            place.unlink()  # rather none than a wrong one


def _last(root: Path, rig: str) -> Path:
    return root / f".{rig}.last"


def newest(root: Path, rig: str) -> Path:
    """The newest of a rig's sessions, one that is still written included.

    Raises:
        SessionError: there is none.
    """
    found = _newest_first(root, rig, time.time_ns())
    if not found:
        raise SessionError(f"{root}: found no recording of {rig}, expected one of its recorder")
    return found[0]


def last_written_ns(root: Path, rig: str) -> int | None:
    """When a file of the rig's sessions was written last [ns]; None if there is none."""
    try:
        return max(map(_written_ns, filter(_has_segments, sessions_of(root, rig))), default=None)
    except OSError:
        return None


def choose(root: Path, run: RunInfo, longest_break: float = LONGEST_BREAK) -> Place:
    """The folder for a recording that starts at `run.t_ns`.

    Args:
        root: folder of all sessions.
        run: description of the recording.
        longest_break: interruption after which a new session starts [s].
    """
    before = _interrupted(root, run)
    if before is not None and abs(run.t_ns - before.ended_ns) <= longest_break * 1e9:
        return before.place
    folder = new_folder(root, run)
    if before is None and math.isfinite(longest_break):
        return _just_ended(folder, root, run)
    if before is None or before.stopped:
        return Place(folder)
    return Place(folder, before.place.last, before.place.positions)


def new_folder(root: Path, run: RunInfo) -> Path:
    """The folder of a session that begins at `run.t_ns`."""
    stamp = datetime.fromtimestamp(run.t_ns // _SECOND_NS, UTC).strftime(_FORMAT)
    return _unused(root / f"{run.rig}-{stamp}")


def age_of(folder: Path, run: RunInfo) -> float:
    """Age at `run.t_ns` of the session in a folder, by its name; 0 if that is no time [s]."""
    stamp = folder.name.removeprefix(f"{run.rig}-").partition("Z")[0] + "Z"
    try:
        began = datetime.strptime(stamp, _FORMAT).replace(tzinfo=UTC)
    except ValueError:
        return 0.0
    return run.t_ns / _SECOND_NS - began.timestamp()


def _unused(folder: Path) -> Path:
    number = 2
    found = folder
    while found.exists():
        found = folder.with_name(f"{folder.name}-{number}")
        number += 1
    return found


@dataclass(frozen=True, slots=True)
class _Interrupted:
    """A session of a rig that may go on.

    Attributes:
        place: its end.
        ended_ns: time of its last sample, or of its last file without any [ns].
        stopped: it was closed in order; a recorder that was killed misses what came since.
    """

    place: Place
    ended_ns: int
    stopped: bool

    @property
    def complete(self) -> bool:
        """Whether it says of samples and of messages where to go on."""
        return self.stopped or bool(self.place.last and self.place.positions)


def _interrupted(root: Path, run: RunInfo) -> _Interrupted | None:
    """The newest session of this rig if it has the same configuration.

    One that was killed before it had samples goes on after those of the session before it.
    """
    newest: _Interrupted | None = None
    for one in _sessions(root, run):
        if newest is None:
            newest = one
        elif not one.stopped:
            place, before = newest.place, one.place
            last, positions = place.last or before.last, place.positions or before.positions
            newest = replace(newest, place=Place(place.folder, last, positions))
        if newest.complete or one.stopped:
            break
    return newest


def _just_ended(folder: Path, root: Path, run: RunInfo) -> Place:
    """A new session, after one of another configuration if that has just ended."""
    _, before = next(_ends(root, run), ("", None))
    if before is None or abs(run.t_ns - before.ended_ns) > LONGEST_BREAK * 1e9:
        return Place(folder)
    return Place(folder, before.place.last, before.place.positions, changed=True)


def _sessions(root: Path, run: RunInfo) -> Iterator[_Interrupted]:
    """Sessions of this rig, the newest first, back to another configuration."""
    for configuration, one in _ends(root, run):
        if configuration != run.configuration_sha256:
            return
        yield one


def _ends(root: Path, run: RunInfo) -> Iterator[tuple[str, _Interrupted]]:
    """The hash of the configuration and the end of each session of this rig, the newest first."""
    for folder in _newest_first(root, run.rig, run.t_ns):
        try:
            session = open_session(folder)
            yield session.info.configuration_sha256, _end_of(session)
        except (OSError, SessionError, ValueError):
            continue  # killed before its first message


def _newest_first(root: Path, rig: str, now_ns: int) -> list[Path]:
    """Sessions that have files, by the time of their newest file; those in the future come last.

    The one recorded last keeps its place even so: the clock may have been set back since.
    """
    last = ""
    with contextlib.suppress(OSError, ValueError):
        last = _last(root, rig).read_text(encoding="utf-8")
    try:
        folders = list(filter(_has_segments, sessions_of(root, rig)))
        written = {path: _written_ns(path) for path in folders}
    except OSError:
        return []
    known = any(path.name == last for path in folders)

    def place(path: Path) -> tuple[bool, int]:
        ahead = known and path.name != last and written[path] > now_ns
        return not ahead, written[path]

    return sorted(folders, key=place, reverse=True)


def _has_segments(folder: Path) -> bool:
    return any(folder.glob(f"*{SUFFIX}"))


def _written_ns(folder: Path) -> int:
    return max(file.stat().st_mtime_ns for file in folder.iterdir())


def _end_of(session: Session) -> _Interrupted:
    block, stopped = last_block(session, SAMPLES), not _broke_off(session)
    last = None if block is None else (block.boot, block.seq + len(block) - 1)
    ended_ns = _written_ns(session.path) if block is None else int(block.t_ns[-1])
    place = Place(session.path, last, load_positions(session.path))
    return _Interrupted(place, ended_ns, stopped)


def _broke_off(session: Session) -> bool:
    return bool(Session(session.path, session.segments[-1:]).unclosed)


def last_block(session: Session, topic: Topic) -> Block | None:
    """The last block of samples or estimates, in the last segment that has any."""
    for path in reversed(session.segments):
        one = Session(path, (path,))
        found: Iterator[Block] = one.samples() if topic is SAMPLES else one.estimates()
        last = deque(found, maxlen=1)
        if last:
            return last[0]
    return None
