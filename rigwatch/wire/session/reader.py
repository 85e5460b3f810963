"""Opens a session: one MCAP file, or a folder of segments in the order of their names.

    session = open_session("sessions/bench1-20260101T120000Z")
    for block in session.samples(): …
    for span in session.lost: …

Everything intact is delivered, every checksum is checked, and what cannot be read is in `lost`.
Memory is that of one chunk and one merged block, however long the recording is.
"""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any, cast

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel, Schema

from rigwatch.wire.errors import MessageError, SessionError
from rigwatch.wire.messages import (
    ESTIMATES,
    SAMPLES,
    TOPICS,
    EstimateBlock,
    Message,
    RunInfo,
    SampleBlock,
    Topic,
    blocks,
    topic,
)
from rigwatch.wire.messages import protobuf as schema
from rigwatch.wire.session.chunks import Damage, ends_closed, scan
from rigwatch.wire.session.packed import decode_block
from rigwatch.wire.session.statistics import topic_counts
from rigwatch.wire.session.writer import FORMAT, FORMAT_KEY, message_time

SUFFIX = ".mcap"
MERGED_SAMPLES = 16384
"""Samples in a block that `Session.samples` delivers, where nothing interrupts it."""
_RECORD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_SCHEMA, _CHANNEL, _MESSAGE = 0x03, 0x04, 0x05
_BY_NUMBER = dict(enumerate(TOPICS, start=1))
_BY_NAMES = {(line.name, schema.type_name(line.message)): line for line in TOPICS}


@dataclass(frozen=True, slots=True)
class LostSpan:
    """A part of a session that could not be read.

    Attributes:
        file: the segment.
        offset, size: which bytes of it.
        after_ns: time of the last message read before it [ns], None where there is none.
        before_ns: time of the first message read after it [ns], None where there is none.
        reason: what is wrong, in words.
    """

    file: Path
    offset: int
    size: int
    after_ns: int | None
    before_ns: int | None
    reason: str


@dataclass(frozen=True, slots=True)
class Recorded:
    """One message of a session, with its topic and the time it was recorded under [ns]."""

    topic: Topic
    t_ns: int
    message: Message


def open_session(path: Path | str) -> "Session":
    """The session at `path`, a file or a folder of segments.

    Raises:
        SessionError: there is none, it is not an MCAP file, of a later version, or holds nothing of
            rigwatch.
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
        path: what was opened.
        segments: its files, in order.
    """

    def __init__(self, path: Path, segments: tuple[Path, ...]) -> None:
        self.path, self.segments = path, segments
        self._lost: dict[tuple[int, int], LostSpan] = {}

    @property
    def lost(self) -> tuple[LostSpan, ...]:
        """Damage met so far, in order; complete after one pass through the session."""
        return tuple(self._lost[key] for key in sorted(self._lost))

    @property
    def unclosed(self) -> tuple[Path, ...]:
        """Segments that end without an index: still being written, killed, or truncated."""
        return tuple(path for path in self.segments if not ends_closed(path))

    @cached_property
    def info(self) -> RunInfo:
        """What the run was made with: the first `RunInfo` that can be read.

        Raises:
            SessionError: no segment has one left.
        """
        for recorded in self.messages(["run"]):
            if isinstance(recorded.message, RunInfo):
                return recorded.message
        raise SessionError(f"{self.path}: the description of the run (RunInfo) is lost")

    def may_hold(self, name: str) -> bool:
        """False only where every segment is closed and says that it has no message of the topic
        `name`; costs no pass through the session.
        """
        said = [topic_counts(path) for path in self.segments]
        return any(counts is None or counts.get(name, 0) > 0 for counts in said)

    def check_content(self) -> None:
        """Raise where the session holds no message of rigwatch at all."""
        foreign: set[str] = set()
        for index in range(len(self.segments)):
            for _ in self._records(index, foreign):
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
        """The messages in the order in which they were recorded.

        Args:
            topics: names in the table of topics, None for all.
            start: no messages before this time, and no samples of blocks that began before it [ns].
            end: no messages and no samples from this time on [ns].

        Raises:
            SessionError: a segment cannot be opened, or there is no such topic.
        """
        wanted = set(TOPICS) if topics is None else {_topic(name) for name in topics}
        for index in range(len(self.segments)):
            for line, t_ns, data in self._records(index):
                if line not in wanted:
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
        """The samples as large merged blocks, none of which bridges a gap, restart or new channel.

        A sample that was recorded twice is delivered once.

        Args:
            device: whose samples, None for all (merged only while one device speaks).
            start, end: time span [start, end) [ns].
            size: samples after which a block is delivered.
        """
        return self._merged(SAMPLES, device, start, end, size)

    def estimates(
        self,
        device: str | None = None,
        start: int | None = None,
        end: int | None = None,
        size: int = MERGED_SAMPLES,
    ) -> Iterator[EstimateBlock]:
        """The recorded estimates, merged as in `samples`."""
        return self._merged(ESTIMATES, device, start, end, size)

    def _merged(
        self, line: Topic, device: str | None, start: int | None, end: int | None, size: int
    ) -> Iterator[Any]:
        return blocks.merged(self._blocks(line, device, start, end), size)

    def _blocks(
        self, line: Topic, device: str | None, start: int | None, end: int | None
    ) -> Iterator[Any]:
        """Blocks of one topic, each sample once."""
        following: dict[tuple[str, int], int] = {}
        for index in range(len(self.segments)):
            for found, _, data in self._records(index):
                if found is not line:
                    continue
                block = self._block(line, data)
                if device is not None and block.device != device:
                    continue
                key = (block.device, block.boot)
                block = blocks.unseen(block, following.get(key))
                if block is None:
                    continue
                following[key] = block.seq + len(block)
                if start is not None or end is not None:
                    block = blocks.between(block, start, end)
                if block is not None:
                    yield block

    def _records(
        self, index: int, foreign: set[str] | None = None
    ) -> Iterator[tuple[Topic, int, bytes]]:
        """Topic, time and bytes of every message of one segment; damage is noted as it is met."""
        reader = _ChunkReader(self.segments[index], set() if foreign is None else foreign)
        damage: list[Damage] = []
        last: int | None = None
        try:
            for item in scan(self.segments[index]):
                if isinstance(item, Damage):
                    damage.append(item)
                    continue
                for line, t_ns, data in reader.messages(item.records):
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
            return schema.decode(line.message, data)
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


class _ChunkReader:
    """Cuts the records of intact chunks into messages, with the channels that were declared so far.

    The numbers of the table of topics are taken for channels that nobody declared, as their
    declaration stands in a damaged chunk.
    """

    def __init__(self, path: Path, foreign: set[str]) -> None:
        self._path, self._foreign = path, foreign
        self._schemas: dict[int, str] = {}
        self._lines: dict[int, Topic | None] = {}

    def messages(self, records: bytes) -> Iterator[tuple[Topic, int, bytes]]:
        """Topic, time and bytes of each message.

        Raises:
            SessionError: a record is none, although its checksum is right, or of a later version.
        """
        try:
            yield from self._cut(records)
        except (struct.error, McapError, ValueError, RecursionError) as error:
            raise SessionError(f"{self._path}: a malformed record: {error}") from None

    def _cut(self, records: bytes) -> Iterator[tuple[Topic, int, bytes]]:
        at, end = 0, len(records)
        while at + _RECORD.size <= end:
            opcode, length = _RECORD.unpack_from(records, at)
            at += _RECORD.size
            if opcode == _MESSAGE:
                number, _, t_ns, _ = _MESSAGE_HEAD.unpack_from(records, at)
                line = self._line(number)
                if line is not None:
                    yield line, t_ns, records[at + _MESSAGE_HEAD.size : at + length]
            elif opcode == _SCHEMA:
                self._schemas |= _read_schema(records[at : at + length])
            elif opcode == _CHANNEL:
                self._declare(records[at : at + length])
            at += length

    def _line(self, number: int) -> Topic | None:
        return self._lines[number] if number in self._lines else _BY_NUMBER.get(number)

    def _declare(self, body: bytes) -> None:
        channel = Channel.read(ReadDataStream(BytesIO(body)))
        line = _BY_NAMES.get((channel.topic, self._schemas.get(channel.schema_id, "")))
        self._lines[channel.id] = line
        if line is None:
            self._foreign.add(channel.topic)
            return
        version = channel.metadata.get(FORMAT_KEY, "1")
        if not version.isdigit() or int(version) > FORMAT:
            raise SessionError(
                f"{self._path}: session format {version}, this rigwatch reads up to {FORMAT}"
            )


def _read_schema(body: bytes) -> dict[int, str]:
    found = Schema.read(ReadDataStream(BytesIO(body)))
    return {found.id: found.name}
