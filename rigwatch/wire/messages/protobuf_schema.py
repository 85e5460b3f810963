"""The protobuf schema of the messages, built at run time from `message_types.py`.

The descriptors need no compiler, and MCAP files store `file_descriptor_set` so that other tools can
decode a session.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import cache
from typing import Any, Literal, get_args, get_origin, get_type_hints

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import Message as ProtoMessage

from rigwatch.wire.arrays import FloatArray, IntArray
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
KINDS: dict[str, Any] = {kind.__name__: kind for kind in (Column, *MESSAGE_TYPES)}


def type_name(kind: type[Message]) -> str:
    """Full protobuf name of a message class, such as "rigwatch.SampleBlock"."""
    return f"{PACKAGE}.{kind.__name__}"


def is_map(annotation: Any) -> bool:
    """Whether a field is a map of figures."""
    return get_origin(annotation) is Mapping


def is_columns(annotation: Any) -> bool:
    """Whether a field holds columns."""
    return get_origin(annotation) in {tuple, Sequence} and get_args(annotation)[0] is Column


def _add_field(proto: descriptor_pb2.DescriptorProto, name: str, number: int, hint: Any) -> None:
    if is_columns(hint):
        proto.field.add(
            name=name,
            number=number,
            type=_Field.TYPE_MESSAGE,
            label=_Field.LABEL_REPEATED,
            type_name=f".{PACKAGE}.Column",
        )
    elif is_map(hint):
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
    for kind in KINDS.values():
        proto = file.message_type.add(name=kind.__name__)
        for number, (name, hint) in enumerate(hints_of(kind), start=1):
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


def hints_of(kind: Any) -> list[tuple[str, Any]]:
    """Names and annotations of a message's fields, in order."""
    hints = get_type_hints(kind)
    return [(field.name, hints[field.name]) for field in fields(kind)]


def _proto_classes() -> dict[str, type[ProtoMessage]]:
    pool = descriptor_pool.DescriptorPool()
    pool.Add(_file_descriptor())
    found = {name: pool.FindMessageTypeByName(f"{PACKAGE}.{name}") for name in KINDS}
    return {name: message_factory.GetMessageClass(one) for name, one in found.items()}


# Made at import, in one thread: two threads that made them at once would each have a pool of its
# own, and a column of one does not fit into a block of the other.
_PROTO_CLASSES = _proto_classes()


def proto_class(name: str) -> type[ProtoMessage]:
    """The protobuf class of a message class's name."""
    return _PROTO_CLASSES[name]
