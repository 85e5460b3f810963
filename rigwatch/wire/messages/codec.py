"""Bytes of the messages: blocks by the quick way, all others by the general one."""

from collections.abc import Sequence
from typing import Any, TypeVar, cast

from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages import protobuf
from rigwatch.wire.messages.block_decoding import decode_joined, decode_own
from rigwatch.wire.messages.blocks import Block
from rigwatch.wire.messages.message_types import EstimateBlock, Message, SampleBlock
from rigwatch.wire.messages.packed_encoding import encode_block

M = TypeVar("M", bound=Message)


def encode(message: Message) -> bytes:
    """Encode a message as protobuf bytes."""
    if isinstance(message, Block):
        return encode_block(message)
    return protobuf.encode(message)


def decode(kind: type[M], data: bytes) -> M:
    """Decode a message of class `kind`, with arrays of its own.

    Raises:
        MessageError: the bytes are not such a message, or its columns differ in length.
    """
    if kind is SampleBlock:
        return cast(M, decode_own(SampleBlock, data))
    if kind is EstimateBlock:
        return cast(M, decode_own(EstimateBlock, data))
    return protobuf.decode(kind, data)


def decode_all(kind: type[M], payloads: Sequence[bytes]) -> tuple[list[M], int]:
    """The messages in `payloads`, and how many of them are not valid.

    Blocks are joined where one continues another, which costs little more than one of them.
    """
    if kind in {SampleBlock, EstimateBlock}:
        return cast(tuple[list[M], int], decode_joined(cast(Any, kind), payloads))
    found = []
    for data in payloads:
        try:
            found.append(decode(kind, data))
        except MessageError:
            continue
    return found, len(payloads) - len(found)
