"""Values as structs: one thread at a time, as msgspec prepares a class when it first meets it.

While it does so it runs Python code, and a thread that meets the class meanwhile takes what is half
prepared and ends the process. Rigs of one process read their files in threads of their own.
"""

import threading
from typing import Any, TypeVar

import msgspec

T = TypeVar("T")
_preparing = threading.RLock()


def as_kind(raw: Any, kind: type[T], *, strict: bool = True) -> T:
    """Plain values as a struct, or another type.

    Raises:
        msgspec.ValidationError: they are not of this kind.
    """
    with _preparing:
        return msgspec.convert(raw, kind, strict=strict)


def json_decoder(kind: type[T]) -> "msgspec.json.Decoder[T]":
    """A decoder of JSON as this kind."""
    with _preparing:
        return msgspec.json.Decoder(kind)
