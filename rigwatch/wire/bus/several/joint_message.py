"""Messages of several rigs as one message.

    count (uint16) | of each: lengths of rig and mark (uint16), of payload (uint32)
                   | of each: rig, mark, payload

All integers are little endian. The payloads are those that each rig's own key carries.
"""

import struct
from collections.abc import Sequence

from rigwatch.wire.errors import MessageError

Part = tuple[str, bytes, bytes]
"""A rig's id, and a mark and payload of it."""
_COUNT, _LENGTHS = struct.Struct("<H"), struct.Struct("<HHI")
MOST_PARTS = (1 << 16) - 1


def joint_key(key: str) -> str:
    """Where the messages of a topic of several rigs arrive; `key` is that within a rig."""
    return f"joined/{key}"


def size_of(part: Part) -> int:
    """What a message takes among others [bytes]."""
    rig, mark, payload = part
    return _LENGTHS.size + len(rig) + len(mark) + len(payload)


def join(parts: Sequence[Part]) -> bytes:
    """One message of at most `MOST_PARTS` others; ids are ASCII."""
    pieces = [_COUNT.pack(len(parts))]
    for rig, mark, payload in parts:
        pieces.append(_LENGTHS.pack(len(rig), len(mark), len(payload)))
    for rig, mark, payload in parts:
        pieces += rig.encode(), mark, payload
    return b"".join(pieces)


def split(data: bytes) -> list[Part]:
    """The messages that were joined, in order.

    Raises:
        MessageError: these are not the bytes of such a message.
    """
    try:
        (count,) = _COUNT.unpack_from(data)
        start = _COUNT.size + count * _LENGTHS.size
        found, at = [], start
        for rig, mark, payload in _LENGTHS.iter_unpack(data[_COUNT.size : start]):
            middle = at + rig + mark
            end = middle + payload
            found.append((data[at : at + rig].decode(), data[at + rig : middle], data[middle:end]))
            at = end
    except (struct.error, UnicodeDecodeError):
        raise MessageError("joined messages: not a table of lengths and what it names") from None
    if len(found) != count or at != len(data):
        raise MessageError(f"joined messages: {len(data)} bytes, {at} expected by their lengths")
    return found
