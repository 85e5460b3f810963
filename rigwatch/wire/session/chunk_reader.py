"""Records of an MCAP chunk, cut into the messages of the table of topics."""

import struct
from collections.abc import Iterable, Iterator
from functools import lru_cache
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel, Schema

from rigwatch.wire.errors import SessionError, reason_of
from rigwatch.wire.messages import TOPICS, Topic
from rigwatch.wire.messages import protobuf_schema as schema
from rigwatch.wire.session.writer import FORMAT, FORMAT_KEY

_RECORD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_SCHEMA, _CHANNEL, _MESSAGE = 0x03, 0x04, 0x05
_MALFORMED = (struct.error, McapError, ValueError, RecursionError)
_BY_NUMBER = dict(enumerate(TOPICS, start=1))
_BY_NAMES = {(line.name, schema.type_name(line.message)): line for line in TOPICS}

MOST_OTHERS = 10_000
"""Records of a file's chunks that are neither messages nor declarations."""
BASE, RATIO = 1 << 30, 200
"""Bytes that any file may unpack to beside the data of rigwatch, and the same per byte of it."""
SHORT = 1 << 12
"""Longest declaration that is remembered [bytes]; those of rigwatch are shorter."""
RECORD_COST, DECLARATION_COST = 512, 1 << 14
"""Bytes that take the time of a record without content, and of a declaration."""


class ChunkReader:
    """Splits the records of intact chunks into messages, with the channels declared so far.

    Undeclared channels, whose declaration was in a damaged chunk, take the numbers of the table of
    topics. What a file may unpack to is bounded by its size: packed, millions of records take no
    room. Content of rigwatch's own messages is not counted, since a constant recording packs well.

    Args:
        path: the file.
        foreign: takes the names of topics of others.

    Raises:
        SessionError: the file cannot be read.
    """

    def __init__(self, path: Path, foreign: set[str]) -> None:
        self._path, self._foreign = path, foreign
        self._schemas: dict[int, str] = {}
        self._lines: dict[int, Topic | None] = {}
        self._others = 0
        self._left = BASE + RATIO * _size(path)

    def messages(
        self, records: bytes, wanted: Topic | None = None
    ) -> Iterator[tuple[Topic, int, bytes]]:
        """Topic, time and bytes of each message; no bytes of others than `wanted`, if it is given.

        Raises:
            SessionError: a record with a right checksum is malformed, or has a later version.
        """
        try:
            yield from self._cut(records, wanted)
        except _MALFORMED as error:
            raise self._malformed(error) from None

    def declared(self, declarations: Iterable[tuple[int, bytes]]) -> dict[int, Topic | None]:
        """The topic of each channel, once these schema and channel records are read.

        Raises:
            SessionError: a record is malformed, or has a later version.
        """
        try:
            for opcode, body in declarations:
                self._declare(opcode, body)
        except _MALFORMED as error:
            raise self._malformed(error) from None
        return dict(self._lines)

    def _malformed(self, error: Exception) -> SessionError:
        return SessionError(f"{self._path}: a malformed record: {error}")

    def _cut(self, records: bytes, wanted: Topic | None) -> Iterator[tuple[Topic, int, bytes]]:
        at, end = 0, len(records)
        while at + _RECORD.size <= end:
            opcode, length = _RECORD.unpack_from(records, at)
            at += _RECORD.size
            self._left -= RECORD_COST
            if self._left < 0:
                raise ValueError("unpacks to far more than a file of its size, expected less")
            if opcode == _MESSAGE:
                number, _, t_ns, _ = _MESSAGE_HEAD.unpack_from(records, at)
                line = self._line(number)
                if line is not None:
                    kept = wanted is None or line is wanted
                    begin = at + _MESSAGE_HEAD.size
                    yield line, t_ns, records[begin : at + length] if kept else b""
                else:
                    self._left -= length
            elif opcode in (_SCHEMA, _CHANNEL):
                self._left -= length + DECLARATION_COST
                self._declare(opcode, records[at : at + length])
            else:
                self._left -= length
                self._pass_over()
            at += length

    def _pass_over(self) -> None:
        """Pass over a record of another kind; packed, millions of empty ones are a small file."""
        self._others += 1
        if self._others > MOST_OTHERS:
            raise ValueError(f"more than {MOST_OTHERS} records of kinds that no session has")

    def _line(self, number: int) -> Topic | None:
        return self._lines[number] if number in self._lines else _BY_NUMBER.get(number)

    def _declare(self, opcode: int, body: bytes) -> None:
        found = declaration(opcode, body)
        if isinstance(found, Schema):
            self._schemas[found.id] = found.name
        else:
            self._declare_channel(found)

    def _declare_channel(self, channel: Channel) -> None:
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


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError as error:
        raise SessionError(f"{path}: cannot be read: {reason_of(error)}") from error


def declaration(opcode: int, body: bytes) -> Schema | Channel:
    """The schema or channel in a record's body.

    Raises:
        ValueError, EOFError, McapError, struct.error: it is malformed.
    """
    return (_remembered if len(body) <= SHORT else _read)(opcode, body)


@lru_cache(maxsize=64)
def _remembered(opcode: int, body: bytes) -> Schema | Channel:
    """The same, remembered, as all files of a version declare the same."""
    return _read(opcode, body)


def _read(opcode: int, body: bytes) -> Schema | Channel:
    kind: type[Schema | Channel] = Schema if opcode == _SCHEMA else Channel
    found: Schema | Channel = kind.read(ReadDataStream(BytesIO(body)))
    return found
