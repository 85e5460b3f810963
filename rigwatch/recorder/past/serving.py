"""Answers questions from the session files of a rig, for what its rings no longer hold."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rigwatch.recorder.past.pages import PAGE_BYTES, Bookmark, Page, Question
from rigwatch.recorder.past.shares import Shares
from rigwatch.recorder.session_list import sessions_of
from rigwatch.wire.bus import Bus
from rigwatch.wire.messages import PAST_KEY, topic
from rigwatch.wire.session import SUFFIX, Place, Wanted, read_page

BYTES_PER_SECOND = 4_000_000
"""Rate of the answers, so that the recording goes on beside them: 25 rigs as they run [bytes/s]."""
AHEAD = 1.0
"""How far answers may be ahead of that rate; a question beyond gets none, and is repeated [s].
Of several askers those that had less are served first."""
PAGE_TIME, SHARE = 0.05, 0.5
"""Time after which a page ends, however little was found [s], and share of the time for pages."""
_MARGIN = 60.0


class PastServer:
    """Answers questions for the sessions of one rig.

    Args:
        bus: on which questions come.
        root: folder of the sessions.
        settled: returns the time before which everything is on the disk [ns].
    """

    def __init__(self, bus: Bus, root: Path, settled: Callable[[], int]) -> None:
        self._rig, self._root, self._settled = bus.rig, root, settled
        self._free_at = 0.0
        self._shares = Shares()
        self.close = bus.serve(PAST_KEY, self.answer)

    def answer(self, data: bytes) -> list[bytes]:
        """A page; none while answers are too far ahead of their rate, whoever asks.

        It never waits: what waits here delays the end of the recorder.
        """
        question, began = Question.from_bytes(data), time.monotonic()
        if not self._shares.admits(question.asker, began):
            return []
        if self._free_at > began + AHEAD:
            self._shares.refused(question.asker, began)
            return []
        page = self.page(question).to_bytes()
        taken = max(len(page) / BYTES_PER_SECOND, (time.monotonic() - began) / SHARE)
        self._free_at = max(self._free_at, began) + taken
        self._shares.served(question.asker, taken, began)
        return [page]

    def page(self, question: Question) -> Page:
        """The next page of an answer.

        Raises:
            KeyError: there is no such topic.
            SessionError: a segment cannot be read.
        """
        # Read before the segments: what is on the disk now is found in them.
        settled = self._settled()
        segments = sorted(self._segments(question.start), key=_name)
        topics = frozenset(map(topic, question.topics))
        wanted = Wanted(topics, question.start, question.end, PAGE_BYTES)
        until = time.monotonic() + PAGE_TIME
        parts, place = read_page(
            segments,
            wanted,
            _place(segments, question.bookmark),
            lambda: time.monotonic() >= until,
        )
        return Page(tuple(parts), settled, _bookmark(segments, place))

    def _segments(self, start: int) -> Iterator[Path]:
        """Segments that were still written at `start` [ns]."""
        since = start / 1e9 - _MARGIN
        for folder in sessions_of(self._root, self._rig):
            # Paths are made of what is found only: a year has twenty thousand segments.
            with contextlib.suppress(OSError), os.scandir(folder) as entries:
                yield from [Path(one) for one in entries if _is_written(one, since)]


def _is_written(entry: "os.DirEntry[str]", since: float) -> bool:
    """Whether it is a segment that was still written at `since` [s]."""
    try:
        return entry.name.endswith(SUFFIX) and entry.stat().st_mtime >= since
    except OSError:
        return False  # removed by retention


def _bookmark(segments: list[Path], place: Place | None) -> Bookmark | None:
    if place is None:
        return None
    return Bookmark(_name(segments[place.segment]), place.offset, place.parts)


def _name(path: Path) -> str:
    return f"{path.parent.name}/{path.name}"


def _place(segments: list[Path], bookmark: Bookmark | None) -> Place:
    """The place of a bookmark; if its segment is gone, that of the next one."""
    if bookmark is None:
        return Place()
    names = [*map(_name, segments)]
    number = sum(name < bookmark.segment for name in names)
    if number < len(names) and names[number] == bookmark.segment:
        return Place(number, bookmark.offset, bookmark.parts)
    return Place(number)
