"""Plain values as TOML."""

from collections.abc import Iterator, Mapping
from typing import Any

import msgspec


def as_toml(tree: Mapping[str, Any]) -> str:
    """A tree of plain values as TOML text; None is omitted."""
    return "\n".join(_lines(tree, "")) + "\n"


def _lines(tree: Mapping[str, Any], prefix: str) -> Iterator[str]:
    tables = {key: value for key, value in tree.items() if _is_table(value)}
    for key, value in tree.items():
        if key not in tables and value is not None:
            yield f"{_key(key)} = {_value(value)}"
    for key, value in tables.items():
        name = f"{prefix}{_key(key)}"
        is_one = isinstance(value, dict)
        for table in [value] if is_one else value:
            yield f"\n[{name}]" if is_one else f"\n[[{name}]]"
            yield from _lines(table, f"{name}.")


def _is_table(value: object) -> bool:
    is_many = isinstance(value, list | tuple) and bool(value) and isinstance(value[0], dict)
    return isinstance(value, dict) or is_many


def quoted(text: str) -> str:
    """A text as TOML, whatever letters it has."""
    return _value(text)


def _key(key: str) -> str:
    is_bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if is_bare else _value(key)


def _value(value: object) -> str:
    # JSON and TOML write text, numbers, booleans and lists alike.
    return msgspec.json.encode(value).decode()
