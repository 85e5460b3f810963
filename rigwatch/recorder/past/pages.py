"""Questions to a site's recordings and the pages of an answer, as bytes.

question    JSON
page        length of its head (u32), head as JSON, then of each message: number of its topic
            (u8), length (u32), bytes
"""

import struct
from dataclasses import dataclass

import msgspec

from rigwatch.wire.bus import MAX_PAYLOAD
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import TOPICS, Topic
from rigwatch.wire.session import Part
from rigwatch.wire.typed_files import JsonError, json_value

PAGE_BYTES = MAX_PAYLOAD // 2
LARGEST_QUESTION = 4096
_HEAD = struct.Struct("<I")
_PART = struct.Struct("<BI")


class Bookmark(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where the next page begins: name of a segment, offset in it, messages read there."""

    segment: str
    offset: int
    parts: int


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Messages of these topics with times in [start, end) [ns], from a bookmark on.

    `asker` tells askers apart, which share the rate of the answers.
    """

    topics: tuple[str, ...]
    start: int
    end: int
    bookmark: Bookmark | None = None
    asker: str = ""

    def to_bytes(self) -> bytes:
        """The question as bytes."""
        return msgspec.json.encode(self)

    @classmethod
    def from_bytes(cls, data: bytes) -> "Question":
        """The question in `data`.

        Raises:
            MessageError: the bytes are not a question.
        """
        try:
            return json_value(data[:LARGEST_QUESTION], cls)
        except JsonError as error:
            raise MessageError(f"question to the recordings: {error}") from None


class _Head(msgspec.Struct, frozen=True):
    settled: int
    bookmark: Bookmark | None


@dataclass(frozen=True, slots=True)
class Page:
    """A part of an answer.

    Attributes:
        parts: messages, in recorded order.
        settled: everything of an earlier time is on the disk [ns].
        bookmark: where the next page begins; None for the last.
    """

    parts: tuple[Part, ...]
    settled: int
    bookmark: Bookmark | None

    def to_bytes(self) -> bytes:
        """The page as bytes."""
        head = msgspec.json.encode(_Head(self.settled, self.bookmark))
        pieces = [_HEAD.pack(len(head)), head]
        for line, data in self.parts:
            pieces += (_PART.pack(TOPICS.index(line), len(data)), data)
        return b"".join(pieces)

    @classmethod
    def from_bytes(cls, data: bytes) -> "Page":
        """The page in `data`.

        Raises:
            MessageError: the bytes are not a page.
        """
        try:
            (length,) = _HEAD.unpack_from(data)
            at = _HEAD.size + length
            head = json_value(data[_HEAD.size : at], _Head)
            return cls(tuple(_parts(data, at)), head.settled, head.bookmark)
        except (struct.error, IndexError, ValueError) as error:
            raise MessageError(f"page of a recording: {error}") from None


def _parts(data: bytes, at: int) -> list[tuple[Topic, bytes]]:
    found = []
    while at < len(data):
        number, length = _PART.unpack_from(data, at)
        at += _PART.size
        if at + length > len(data):
            raise ValueError("truncated")
        found.append((TOPICS[number], data[at : at + length]))
        at += length
    return found
