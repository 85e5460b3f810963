"""Protobuf bytes of the messages: all are encoded and decoded here."""

from collections.abc import Callable
from functools import cache
from typing import Any, Literal, TypeVar, get_args, get_origin

import numpy as np
from google.protobuf.message import DecodeError
from google.protobuf.message import Message as ProtoMessage

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages.message_types import ByteArray, Column, Message
from rigwatch.wire.messages.protobuf_schema import (
    KINDS,
    hints_of,
    is_columns,
    is_map,
    proto_class,
)

M = TypeVar("M", bound=Message)
MOST_COLUMNS = 4096
"""Columns of a block."""


def _to_wire(hint: Any) -> Callable[[Any], Any]:
    if is_columns(hint):
        column = proto_class("Column")
        return lambda value: [_fill(column(), part) for part in value]
    if hint == ByteArray:
        return lambda value: value.tobytes()
    if hint in (FloatArray, IntArray):
        return lambda value: value.tolist()
    if is_map(hint):
        return dict
    return lambda value: value


def _from_wire(hint: Any) -> Callable[[Any], Any]:
    if is_columns(hint):
        return lambda value: tuple(_read(Column, part) for part in value)
    if hint == ByteArray:
        # A read-only view is another type to compiled kernels, which would be recompiled for it.
        return lambda value: np.frombuffer(value, np.uint8).copy()
    if hint == FloatArray:
        return lambda value: np.array(value, np.float64)
    if hint == IntArray:
        return lambda value: np.array(value, np.int64)
    if get_origin(hint) is Literal:
        return _literal(get_args(hint))
    return dict if is_map(hint) else lambda value: value


def _literal(allowed: tuple[str, ...]) -> Callable[[str], str]:
    def check(value: str) -> str:
        if value not in allowed:
            raise MessageError(f"found {value!r}, expected one of {', '.join(allowed)}")
        return value

    return check


@cache
def _codec(name: str) -> list[tuple[str, Callable[[Any], Any], Callable[[Any], Any]]]:
    return [(field, _to_wire(hint), _from_wire(hint)) for field, hint in hints_of(KINDS[name])]


def _fill(proto: ProtoMessage, message: Any) -> ProtoMessage:
    return type(proto)(
        **{name: out(getattr(message, name)) for name, out, _ in _codec(type(message).__name__)}
    )


def _read(kind: type[Any], proto: ProtoMessage) -> Any:
    return kind(*[back(getattr(proto, name)) for name, _, back in _codec(kind.__name__)])


def encode(message: Message) -> bytes:
    """Encode a message as protobuf bytes."""
    kind = type(message)
    # Counters are a map, whose order changes from run to run.
    return _fill(proto_class(kind.__name__)(), message).SerializeToString(deterministic=True)


def decode(kind: type[M], data: bytes) -> M:
    """Decode a message of class `kind`.

    Raises:
        MessageError: the bytes are not such a message, or its columns differ in length.
    """
    try:
        found = proto_class(kind.__name__).FromString(data)
        _check_columns(found)
        message: M = _read(kind, found)
    except (DecodeError, MessageError) as error:
        raise MessageError(
            f"{kind.__name__}: {len(data)} bytes cannot be decoded: {error}"
        ) from error
    _check_lengths(message)
    return message


def _check_columns(found: Any) -> None:
    """Raise if there are more columns than a rig has: empty ones take two bytes each."""
    count = max(len(getattr(found, name, ())) for name in ("channels", "columns"))
    if count > MOST_COLUMNS:
        raise MessageError(f"{count} columns, expected at most {MOST_COLUMNS}")


def _check_lengths(message: Message) -> None:
    columns = getattr(message, "channels", None) or getattr(message, "columns", None)
    if columns is None:
        return
    n = len(message)  # type: ignore[arg-type]
    ragged = [c.name for c in columns if len(c.values) != n or len(c.quality) not in (0, n)]
    if ragged or len(getattr(message, "device_us", ())) not in (0, n):
        kind = type(message).__name__
        raise MessageError(f"{kind}: columns {ragged or ['device_us']} do not have {n} samples")
