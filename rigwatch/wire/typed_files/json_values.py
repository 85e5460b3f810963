"""JSON from outside as a typed value, with one kind of error, and values as JSON."""

from pathlib import Path
from typing import Any, TypeVar

import msgspec

from rigwatch.wire.typed_files.prepared import json_decoder

T = TypeVar("T")


class JsonError(ValueError):
    """The bytes are not JSON of the expected type."""


def json_value(data: bytes | str, kind: type[T]) -> T:
    """The value in `data`.

    Raises:
        JsonError: it is not JSON, not UTF-8, nested too deeply or not of this type.
    """
    return decoded(data, json_decoder(kind))


def decoded(data: bytes | str, decoder: "msgspec.json.Decoder[T]") -> T:
    """The same with a decoder that is used many times.

    Raises:
        JsonError: as in `json_value`.
    """
    try:
        return decoder.decode(data)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise JsonError(str(error)) from None


def as_json(value: Any, *, sort_keys: bool = False) -> bytes:
    """Plain data, dataclasses, paths and arrays as JSON; a number that is not finite is null.

    Args:
        value: what is written.
        sort_keys: whether equal values give equal bytes, whatever the order of their keys.

    Raises:
        NotImplementedError: a part of it has no JSON form.
    """
    return msgspec.json.encode(value, enc_hook=_plain, order="deterministic" if sort_keys else None)


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):  # an array or a number of NumPy
        return value.tolist()
    raise NotImplementedError(f"{type(value).__name__} has no JSON form")
