"""What a reader asks of a ring of recent samples and what it gets, as bytes.

    question    boot, first, last                    three int64, little endian
    reply       boot, settled, blocks in order       two int64, then each block's length and bytes

A reply settles the samples from `first` to `settled`: those not in its blocks will never come.
Where `settled` is short of `last`, the reader asks again from there. A ring that does not know the
boot replies with `settled` of -1 and no block.
"""

import struct
from dataclasses import dataclass

from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import SampleBlock, decode, encode

OPEN = 2**62
"""As `last` of a question: whatever there is up to now."""
UNKNOWN = -1
"""As `settled` of a reply: the ring has nothing of that boot."""

_QUESTION = struct.Struct("<qqq")
_REPLY = struct.Struct("<qq")
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class Ask:
    """The samples `first` to `last` of `boot`, both included, are wanted."""

    boot: int
    first: int
    last: int

    def to_bytes(self) -> bytes:
        """The question as it travels."""
        return _QUESTION.pack(self.boot, self.first, self.last)

    @classmethod
    def from_bytes(cls, data: bytes) -> "Ask":
        """The question that `data` holds.

        Raises:
            MessageError: the bytes are no question.
        """
        try:
            return cls(*_QUESTION.unpack(data))
        except struct.error:
            found = f"found {len(data)} bytes, expected {_QUESTION.size}"
            raise MessageError(f"question to the ring: {found}") from None


@dataclass(frozen=True, slots=True)
class RingReply:
    """What a ring has of the samples asked for, and up to where that is all there is."""

    boot: int
    settled: int
    blocks: tuple[SampleBlock, ...]

    def to_bytes(self) -> bytes:
        """The reply as it travels."""
        parts = [_REPLY.pack(self.boot, self.settled)]
        for block in self.blocks:
            data = encode(block)
            parts += (_LENGTH.pack(len(data)), data)
        return b"".join(parts)

    @classmethod
    def from_bytes(cls, data: bytes) -> "RingReply":
        """The reply that `data` holds.

        Raises:
            MessageError: the bytes are no reply.
        """
        try:
            boot, settled = _REPLY.unpack_from(data)
            return cls(boot, settled, tuple(_blocks(data)))
        except struct.error:
            raise MessageError(f"reply of the ring: {len(data)} bytes that are none") from None


def _blocks(data: bytes) -> list[SampleBlock]:
    blocks, at = [], _REPLY.size
    while at < len(data):
        (length,) = _LENGTH.unpack_from(data, at)
        at += _LENGTH.size
        blocks.append(decode(SampleBlock, data[at : at + length]))
        at += length
    return blocks
