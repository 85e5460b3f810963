"""Opens a session: one MCAP file, or a folder of segments in the order of their names.

    session = open_session("sessions/bench1-20260101T120000Z")
    for block in session.samples(): …
    for span in session.lost: …

All intact data are delivered, every checksum is verified, and unreadable parts are listed in
`lost`. Memory use is one chunk and a few merged blocks, for any length of the recording.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, cast

from rigwatch.wire.errors import MessageError, SessionError
from rigwatch.wire.messages import (
    ESTIMATES,
    SAMPLES,
    TOPICS,
    EstimateBlock,
    Message,
    RunInfo,
    SampleBlock,
    Streams,
    Topic,
    blocks,
    decode,
    decode_block,
    topic,
)
from rigwatch.wire.session.chunk_reader import ChunkReader
from rigwatch.wire.session.chunks import Chunk, Damage, ends_closed, scan
from rigwatch.wire.session.file_index import FileIndex, file_index, topic_counts
from rigwatch.wire.session.joined_blocks import joined_blocks
from rigwatch.wire.session.segment import SUFFIX
from rigwatch.wire.session.selected_chunks import selected_chunks
from rigwatch.wire.session.writer import message_time

_Found = tuple[Topic, int, bytes]
MERGED_SAMPLES = 16384
"""Samples in an uninterrupted block of `Session.samples`."""


@dataclass(frozen=True, slots=True)
class LostSpan:
    """An unreadable part of a session.

    Attributes:
        file: the segment.
        offset, size: range of bytes.
        after_ns: time of the last message read before it [ns], None if there is none.
        before_ns: time of the first message read after it [ns], None if there is none.
        reason: the defect, as text.
    """

    file: Path
    offset: int
    size: int
    after_ns: int | None
    before_ns: int | None
    reason: str


@dataclass(frozen=True, slots=True)
class Recorded:
    """One message of a session, with its topic and recorded time [ns]."""

    topic: Topic
    t_ns: int
    message: Message


def open_session(path: Path | str) -> "Session":
    """The session at `path`, a file or a folder of segments.

    Raises:
        SessionError: there is none, it is not an MCAP file, has a later version, or holds no data
            of rigwatch.
    """
    session = Session(Path(path), _segments(Path(path)))
    session.check_content()
    return session


def _segments(path: Path) -> tuple[Path, ...]:
    if path.is_file():
        return (path,)
    if not path.is_dir():
        raise SessionError(f"{path}: no such file or folder, expected a session")
    files = tuple(sorted(path.glob(f"*{SUFFIX}")))
    if not files:
        inside = sorted(item.parent.name for item in path.glob(f"*/*{SUFFIX}"))
        hint = f"; did you mean the folder {inside[-1]} in it?" if inside else ""
        raise SessionError(f"{path}: a folder without session segments (*{SUFFIX}){hint}")
    return files


class Session:
    """A recorded session; made by `open_session`.

    Attributes:
        path: the opened file or folder.
        segments: its files, in order.
    """

    def __init__(self, path: Path, segments: tuple[Path, ...]) -> None:
        self.path, self.segments = path, segments
        self._lost: dict[tuple[int, int], LostSpan] = {}
        self._index: tuple[int, FileIndex] | None = None
        self._opening: tuple[tuple[Topic, bytes], ...] = ()

    @property
    def lost(self) -> tuple[LostSpan, ...]:
        """Damage found so far, in order; complete after one pass through the session."""
        return tuple(self._lost[key] for key in sorted(self._lost))

    @property
    def unclosed(self) -> tuple[Path, ...]:
        """Segments without an index: still open, killed, or truncated."""
        return tuple(path for path in self.segments if not ends_closed(path))

    @cached_property
    def info(self) -> RunInfo:
        """The description of the run: the first readable `RunInfo`.

        Raises:
            SessionError: no segment has one.
        """
        # It comes first, so it mostly was seen when the session was opened. A look at the index
        # would cost more than the search.
        for line, data in chain(self._opening, self._searched()):
            if line.message is RunInfo:
                return cast(RunInfo, self._decode(line, data))
        raise SessionError(f"{self.path}: the description of the run (RunInfo) is lost")

    def _searched(self) -> Iterator[tuple[Topic, bytes]]:
        """Topic and bytes of every message of all segments."""
        for index in range(len(self.segments)):
            for line, _, data in self._scanned(index):
                yield line, data

    def may_hold(self, name: str) -> bool:
        """False only if every segment is closed and reports no message of topic `name`.

        It needs no pass through the session.
        """
        return any(counts is None or counts.get(name, 0) > 0 for counts in self._counted)

    @cached_property
    def _counted(self) -> tuple[dict[str, int] | None, ...]:
        return tuple(topic_counts(path) for path in self.segments)

    def check_content(self) -> None:
        """Raise if the session holds no message of rigwatch."""
        foreign: set[str] = set()
        for index in range(len(self.segments)):
            for line, _, data in self._records(index, foreign):
                self._opening = ((line, data),)
                return
        reason = f"its topics are {', '.join(sorted(foreign)[:5])}" if foreign else ""
        reason = reason or "; ".join(dict.fromkeys(span.reason for span in self.lost)) or "no data"
        raise SessionError(f"{self.path}: holds no message of rigwatch: {reason}")

    def messages(
        self,
        topics: Iterable[str] | None = None,
        start: int | None = None,
        end: int | None = None,
    ) -> Iterator[Recorded]:
        """The messages in recorded order.

        Args:
            topics: names in the table of topics, None for all.
            start: first time of messages, and of samples in blocks that began earlier [ns].
            end: end time (exclusive) [ns].

        Raises:
            SessionError: a segment cannot be opened, or the topic is unknown.
        """
        wanted = None if topics is None else frozenset(map(_topic, topics))
        for index in range(len(self.segments)):
            for line, t_ns, data in self._records(index, wanted=wanted):
                if wanted is not None and line not in wanted:
                    continue
                message = _within(self._decode(line, data), start, end)
                if message is not None:
                    yield Recorded(line, t_ns, message)

    def samples(
        self,
        device: str | None = None,
        start: int | None = None,
        end: int | None = None,
        size: int = MERGED_SAMPLES,
    ) -> Iterator[SampleBlock]:
        """The samples as large merged blocks that bridge no gap, restart or new channel.

        A sample that was recorded twice is delivered once.

        Args:
            device: name of the device, None for all (merged only while one device sends).
            start, end: time span [start, end) [ns].
            size: samples per block.
        """
        return self._merged(SAMPLES, device, start, end, size)

    def estimates(
        self,
        device: str | None = None,
        start: int | None = None,
        end: int | None = None,
        size: int = MERGED_SAMPLES,
    ) -> Iterator[EstimateBlock]:
        """The recorded estimates, merged as in `samples`, of all processes that made some."""
        return self._merged(ESTIMATES, device, start, end, size)

    def _merged(
        self, line: Topic, device: str | None, start: int | None, end: int | None, size: int
    ) -> Iterator[Any]:
        return blocks.merged(self._blocks(line, device, start, end, size), size)

    def _blocks(
        self, line: Topic, device: str | None, start: int | None, end: int | None, size: int
    ) -> Iterator[Any]:
        """Blocks of one topic, each sample once."""
        streams = Streams()
        # A clock may step between two blocks, so a span is taken out of each of them.
        spanned = start is not None or end is not None
        for whole in self._decoded(line, 1 if spanned else size):
            if device is not None and whole.device != device:
                continue
            block = streams.fresh(whole)
            if block is None:
                continue
            part = blocks.between(block, start, end) if spanned else block
            if part is not None:
                yield part

    def _decoded(self, line: Topic, size: int) -> Iterator[Any]:
        """All blocks of one topic, joined up to `size` samples."""
        try:
            for index in range(len(self.segments)):
                found = self._records(index, wanted=frozenset([line]))
                payloads = (data for topic, _, data in found if topic is line)
                yield from joined_blocks(line.message, payloads, size)  # type: ignore[type-var]
        except MessageError as error:
            raise SessionError(f"{self.path}: {error}") from error

    def _records(
        self,
        index: int,
        foreign: set[str] | None = None,
        wanted: frozenset[Topic] | None = None,
    ) -> Iterator[_Found]:
        """Topic, time and bytes of messages of one segment; records damage.

        They are all of the topics that are `wanted`, and maybe others, whose bytes may be missing.
        """
        known = None if wanted is None else self._index_of(index)
        if wanted is None or known is None:
            return self._scanned(index, foreign, wanted)
        return self._selected(index, known, wanted)

    def _index_of(self, index: int) -> FileIndex | None:
        """The index of a closed segment; of the last one asked for, it is remembered."""
        if self._index is None or self._index[0] != index:
            found = file_index(self.segments[index])
            self._index = None if found is None else (index, found)
        return None if self._index is None else self._index[1]

    def _selected(self, index: int, known: FileIndex, wanted: frozenset[Topic]) -> Iterator[_Found]:
        """The same without the chunks that hold other topics alone."""
        reader = ChunkReader(self.segments[index], set())
        lines = reader.declared(known.declarations)
        others = {number for number, line in lines.items() if line not in wanted}
        only, listed = _only(wanted), False
        for item in selected_chunks(self.segments[index], known, others):
            if isinstance(item, Chunk):
                yield from reader.messages(item.records, only)
            elif not listed:
                listed = True
                for _ in self._scanned(index):
                    pass

    def _scanned(
        self,
        index: int,
        foreign: set[str] | None = None,
        wanted: frozenset[Topic] | None = None,
    ) -> Iterator[_Found]:
        """Topic, time and bytes of every message of one segment; records damage."""
        reader = ChunkReader(self.segments[index], set() if foreign is None else foreign)
        only = _only(wanted)
        damage: list[Damage] = []
        last: int | None = None
        try:
            for item in scan(self.segments[index]):
                if isinstance(item, Damage):
                    damage.append(item)
                    continue
                for line, t_ns, data in reader.messages(item.records, only):
                    if damage:
                        self._note(index, damage, last, t_ns)
                        damage = []
                    last = t_ns
                    yield line, t_ns, data
        finally:
            self._note(index, damage, last, None)

    def _decode(self, line: Topic, data: bytes) -> Message:
        if line is SAMPLES or line is ESTIMATES:
            return cast(Message, blocks.owned(self._block(line, data)))
        try:
            return decode(line.message, data)
        except MessageError as error:
            raise SessionError(f"{self.path}: {error}") from error

    def _block(self, line: Topic, data: bytes) -> Any:
        try:
            return decode_block(line.message, data)  # type: ignore[type-var]
        except MessageError as error:
            raise SessionError(f"{self.path}: {error}") from error

    def _note(
        self, index: int, damage: list[Damage], after: int | None, before: int | None
    ) -> None:
        for item in damage:
            span = LostSpan(
                self.segments[index], item.offset, item.size, after, before, item.reason
            )
            if (index, item.offset) not in self._lost or before is not None:
                self._lost[index, item.offset] = span


def _only(wanted: frozenset[Topic] | None) -> Topic | None:
    """The wanted topic, None for several or all."""
    return next(iter(wanted)) if wanted is not None and len(wanted) == 1 else None


def _topic(name: str) -> Topic:
    try:
        return topic(name)
    except KeyError:
        known = ", ".join(line.name for line in TOPICS)
        raise SessionError(f"no topic is called {name!r}, expected one of {known}") from None


def _within(message: Message, start: int | None, end: int | None) -> Message | None:
    if isinstance(message, SampleBlock | EstimateBlock):
        return message if start is None and end is None else blocks.between(message, start, end)  # type: ignore[type-var]
    t_ns = message_time(message)
    early = start is not None and t_ns < start
    return None if early or (end is not None and t_ns >= end) else message
