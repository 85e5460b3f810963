"""Protobuf bytes of the messages; schemas are built at run time from `message_types.py`.

All messages are encoded and decoded here. The descriptors need no compiler, and MCAP files store
`file_descriptor_set` so that other tools can decode a session.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError
from google.protobuf.message import Message as ProtoMessage

from rigwatch.wire.arrays import FloatArray, IntArray
from rigwatch.wire.errors import MessageError
from rigwatch.wire.messages.message_types import MESSAGE_TYPES, ByteArray, Column, Message

PACKAGE = "rigwatch"
_Field = descriptor_pb2.FieldDescriptorProto
_SCALARS: dict[Any, tuple[int, bool]] = {
    str: (_Field.TYPE_STRING, False),
    bool: (_Field.TYPE_BOOL, False),
    int: (_Field.TYPE_SINT64, False),
    float: (_Field.TYPE_DOUBLE, False),
    FloatArray: (_Field.TYPE_DOUBLE, True),
    IntArray: (_Field.TYPE_SFIXED64, True),
    ByteArray: (_Field.TYPE_BYTES, False),
}
_KINDS: dict[str, Any] = {kind.__name__: kind for kind in (Column, *MESSAGE_TYPES)}
M = TypeVar("M", bound=Message)


def type_name(kind: type[Message]) -> str:
    """Full protobuf name of a message class, such as "rigwatch.SampleBlock"."""
    return f"{PACKAGE}.{kind.__name__}"


def _is_map(annotation: Any) -> bool:
    return get_origin(annotation) is Mapping


def _is_columns(annotation: Any) -> bool:
    return get_origin(annotation) is tuple and get_args(annotation)[0] is Column


def _add_field(proto: descriptor_pb2.DescriptorProto, name: str, number: int, hint: Any) -> None:
    if _is_columns(hint):
        proto.field.add(
            name=name,
            number=number,
            type=_Field.TYPE_MESSAGE,
            label=_Field.LABEL_REPEATED,
            type_name=f".{PACKAGE}.Column",
        )
    elif _is_map(hint):
        _add_map(proto, name, number)
    else:
        kind, repeated = _SCALARS[str if get_origin(hint) is Literal else hint]
        label = _Field.LABEL_REPEATED if repeated else _Field.LABEL_OPTIONAL
        proto.field.add(name=name, number=number, type=kind, label=label)


def _add_map(proto: descriptor_pb2.DescriptorProto, name: str, number: int) -> None:
    entry_name = "".join(part.capitalize() for part in name.split("_")) + "Entry"
    entry = proto.nested_type.add(name=entry_name)
    entry.options.map_entry = True
    optional = _Field.LABEL_OPTIONAL
    entry.field.add(name="key", number=1, type=_Field.TYPE_STRING, label=optional)
    entry.field.add(name="value", number=2, type=_Field.TYPE_DOUBLE, label=optional)
    proto.field.add(
        name=name,
        number=number,
        type=_Field.TYPE_MESSAGE,
        label=_Field.LABEL_REPEATED,
        type_name=f".{PACKAGE}.{proto.name}.{entry_name}",
    )


@cache
def _file_descriptor() -> descriptor_pb2.FileDescriptorProto:
    file = descriptor_pb2.FileDescriptorProto(
        name="rigwatch.proto", package=PACKAGE, syntax="proto3"
    )
    for kind in _KINDS.values():
        proto = file.message_type.add(name=kind.__name__)
        for number, (name, hint) in enumerate(_hints(kind), start=1):
            _add_field(proto, name, number, hint)
    return file


@cache
def file_descriptor_set() -> bytes:
    """The serialised FileDescriptorSet of all messages, for MCAP and other tools."""
    bundle = descriptor_pb2.FileDescriptorSet()
    bundle.file.append(_file_descriptor())
    return bundle.SerializeToString()


@cache
def field_tags(kind: type[Message] | type[Column]) -> Mapping[str, int]:
    """The tag byte of each field: its number and wire type."""
    proto = next(p for p in _file_descriptor().message_type if p.name == kind.__name__)
    by_length = 2
    return {
        field.name: field.number << 3 | (0 if _is_varint(field) else by_length)
        for field in proto.field
    }


def _is_varint(field: Any) -> bool:
    single = field.label != _Field.LABEL_REPEATED
    return single and field.type in (_Field.TYPE_SINT64, _Field.TYPE_BOOL)


@cache
def _pool() -> descriptor_pool.DescriptorPool:
    pool = descriptor_pool.DescriptorPool()
    pool.Add(_file_descriptor())
    return pool


@cache
def _proto_class(name: str) -> type[ProtoMessage]:
    return message_factory.GetMessageClass(_pool().FindMessageTypeByName(f"{PACKAGE}.{name}"))


def _hints(kind: Any) -> list[tuple[str, Any]]:
    hints = get_type_hints(kind)
    return [(field.name, hints[field.name]) for field in fields(kind)]


def _to_wire(hint: Any) -> Callable[[Any], Any]:
    if _is_columns(hint):
        column = _proto_class("Column")
        return lambda value: [_fill(column(), part) for part in value]
    if hint == ByteArray:
        return lambda value: value.tobytes()
    if hint in (FloatArray, IntArray):
        return lambda value: value.tolist()
    if _is_map(hint):
        return dict
    return lambda value: value


def _from_wire(hint: Any) -> Callable[[Any], Any]:
    if _is_columns(hint):
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
    return dict if _is_map(hint) else lambda value: value


def _literal(allowed: tuple[str, ...]) -> Callable[[str], str]:
    def check(value: str) -> str:
        if value not in allowed:
            raise MessageError(f"found {value!r}, expected one of {', '.join(allowed)}")
        return value

    return check


@cache
def _codec(name: str) -> list[tuple[str, Callable[[Any], Any], Callable[[Any], Any]]]:
    return [(field, _to_wire(hint), _from_wire(hint)) for field, hint in _hints(_KINDS[name])]


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
    return _fill(_proto_class(kind.__name__)(), message).SerializeToString(deterministic=True)


def decode(kind: type[M], data: bytes) -> M:
    """Decode a message of class `kind`.

    Raises:
        MessageError: the bytes are not such a message, or its columns differ in length.
    """
    try:
        message: M = _read(kind, _proto_class(kind.__name__).FromString(data))
    except (DecodeError, MessageError) as error:
        raise MessageError(f"{kind.__name__}: {len(data)} bytes that are none: {error}") from error
    _check_lengths(message)
    return message


def _check_lengths(message: Message) -> None:
    columns = getattr(message, "channels", None) or getattr(message, "columns", None)
    if columns is None:
        return
    n = len(message)  # type: ignore[arg-type]
    ragged = [c.name for c in columns if len(c.values) != n or len(c.quality) not in (0, n)]
    if ragged or len(getattr(message, "device_us", ())) not in (0, n):
        kind = type(message).__name__
        raise MessageError(f"{kind}: columns {ragged or ['device_us']} do not have {n} samples")
