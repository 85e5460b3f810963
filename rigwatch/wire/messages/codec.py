"""Bytes of the messages: blocks by the quick way, all others by the general one."""

from typing import TypeVar, cast

from rigwatch.wire.messages import protobuf
from rigwatch.wire.messages.blocks import Block, owned
from rigwatch.wire.messages.message_types import EstimateBlock, Message, SampleBlock
from rigwatch.wire.messages.packed import decode_block
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
        return cast(M, owned(decode_block(SampleBlock, data)))
    if kind is EstimateBlock:
        return cast(M, owned(decode_block(EstimateBlock, data)))
    return protobuf.decode(kind, data)
