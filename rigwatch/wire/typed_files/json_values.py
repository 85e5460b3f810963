"""JSON from outside as a typed value: whatever is wrong with it, one kind of error."""

from typing import TypeVar

import msgspec

T = TypeVar("T")


class JsonError(ValueError):
    """The bytes are not JSON of the expected type."""


def json_value(data: bytes | str, kind: type[T]) -> T:
    """The value in `data`.

    Raises:
        JsonError: it is not JSON, not UTF-8, nested too deeply or not of this type.
    """
    return decoded(data, msgspec.json.Decoder(kind))


def decoded(data: bytes | str, decoder: "msgspec.json.Decoder[T]") -> T:
    """The same with a decoder that is used many times.

    Raises:
        JsonError: as in `json_value`.
    """
    try:
        return decoder.decode(data)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise JsonError(str(error)) from None
