"""Queries to a ring of recent samples or messages, and their replies, as bytes.

    question    boot, first, last                    three int64, little endian
    reply       boot, settled, blocks in order       two int64, then each block's length and bytes

A reply settles the samples from `first` to `settled`: those not in its blocks are lost. If
`settled` is less than `last`, the reader queries again from there. A ring without that
boot replies with `settled` = -1, and with a sample of the boot before its present one if it has
any: a reader that was away for the whole of that boot learns of it so. A ring that answers for an
ended boot adds, behind its last sample, one of the boot that came next.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import SampleBlock, decode, encode
from rigwatch.wire.ordering.numbered import Numbered

S = TypeVar("S", SampleBlock, Numbered)
"""The type of items that are ordered."""

OPEN = 2**62
"""As `last` of a query: everything available."""
UNKNOWN = -1
"""As `settled` of a reply: the ring has nothing of that boot."""
EMPTY = -2
"""As `settled` of a reply: the boot has ended, and there was nothing in it."""

_QUESTION = struct.Struct("<qqq")
_REPLY = struct.Struct("<qq")
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Ask:
    """A query for samples `first` to `last` of `boot`, both inclusive."""

    boot: int
    first: int
    last: int

    def to_bytes(self) -> bytes:
        """The query as bytes."""
        return _QUESTION.pack(self.boot, self.first, self.last)

    @classmethod
    def from_bytes(cls, data: bytes) -> "Ask":
        """The query in `data`.

        Raises:
            MessageError: the bytes are not a query.
        """
        try:
            return cls(*_QUESTION.unpack(data))
        except struct.error:
            found = f"found {len(data)} bytes, expected {_QUESTION.size}"
            raise MessageError(f"question to the ring: {found}") from None


@dataclass(frozen=True, slots=True)
class RingReply(Generic[S]):
    """The requested samples that a ring has, and the number up to which they are complete."""

    boot: int
    settled: int
    blocks: tuple[S, ...]

    def to_bytes(self) -> bytes:
        """The reply as bytes."""
        parts = [_REPLY.pack(self.boot, self.settled)]
        for block in self.blocks:
            data = block.to_bytes() if isinstance(block, Numbered) else encode(block)
            parts += (_LENGTH.pack(len(data)), data)
        return b"".join(parts)

    @classmethod
    def from_bytes(cls, data: bytes) -> "RingReply[SampleBlock]":
        """The reply with samples in `data`.

        Raises:
            MessageError: the bytes are not a reply.
        """
        return _parsed(data, lambda part: decode(SampleBlock, part))

    @classmethod
    def of_messages(cls, data: bytes) -> "RingReply[Numbered]":
        """The reply with messages in `data`.

        Raises:
            MessageError: the bytes are not a reply.
        """
        return _parsed(data, Numbered.from_bytes)


def _parsed(data: bytes, read: Callable[[bytes], S]) -> RingReply[S]:
    try:
        boot, settled = _REPLY.unpack_from(data)
        blocks, at = [], _REPLY.size
        while at < len(data):
            (length,) = _LENGTH.unpack_from(data, at)
            at += _LENGTH.size
            blocks.append(read(data[at : at + length]))
            at += length
    except struct.error:
        raise MessageError(f"reply of the ring: {len(data)} bytes cannot be decoded") from None
    if settled >= OPEN:  # the next question, one further, would not fit into its bytes
        raise MessageError(f"reply of the ring: found number {settled}, expected one below {OPEN}")
    return RingReply(boot, settled, tuple(blocks))
