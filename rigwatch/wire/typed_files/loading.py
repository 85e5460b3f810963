"""Typed TOML files: configuration, scenarios and models are structs.

`load` reads a file into a msgspec struct. A key that is misspelt, missing, of the wrong type or out
of range becomes a `ConfigError`: one line with file, line, key, what was found and what was
expected.
"""

import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from rigwatch.wire.errors import ConfigError, reason_of
from rigwatch.wire.typed_files.bounded import loads
from rigwatch.wire.typed_files.explanation import explained
from rigwatch.wire.typed_files.prepared import as_kind

S = TypeVar("S", bound="Section")
LINES = "`key = value` or `[section]`"
ONE_PLACE = "all its keys in one place: one [section], one line of braces, or dotted keys"
_TWICE = re.compile(r"Cannot (?:mutate immutable namespace|declare) \((.*)\)(?: twice)?")
_AT = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)")


class Section(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Base of every struct that is read from a TOML file: frozen, and unknown keys are errors."""


def load(path: Path | str, kind: type[S]) -> S:
    """The file at `path` as a struct of class `kind`.

    Raises:
        ConfigError: the file cannot be read, is not TOML, or is not a valid `kind`.
    """
    return parse(read_text(Path(path)), kind, path)


def parse(text: str, kind: type[S], file: Path | str) -> S:
    """The TOML `text` as a struct of class `kind`; `file` is named in errors.

    Raises:
        ConfigError: the text is not TOML or is not a valid `kind`.
    """
    return converted(tables(text, file), kind, file, text)


def converted(raw: dict[str, Any], kind: type[S], file: Path | str, text: str = "") -> S:
    """Plain values as a struct of class `kind`.

    Args:
        raw: the values by key.
        kind: the class.
        file: named in errors: where the values come from.
        text: of the file, for the line of an error.

    Raises:
        ConfigError: they are not a valid `kind`.
    """
    try:
        return as_kind(raw, kind)
    except msgspec.ValidationError as error:
        raise explained(error, raw, kind, text, file) from None


def tables(text: str, file: Path | str) -> dict[str, Any]:
    """The TOML `text` as plain values; `file` is named in errors.

    Raises:
        ConfigError: the text is not TOML.
    """
    try:
        return loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _malformed(file, str(error)) from error


def _malformed(file: Path | str, complaint: str) -> ConfigError:
    """The error for a complaint such as "Invalid value (at line 3, column 9)"."""
    match = _AT.fullmatch(complaint)
    if match is None:
        return ConfigError(file, "", complaint, "TOML")
    what, line, column = match.groups()
    if again := _TWICE.fullmatch(what):
        table = ".".join(re.findall(r"'([^']*)'", again[1]))
        return ConfigError(file, table, "it a second time", ONE_PLACE, int(line) if line else None)
    if what == "Cannot overwrite a value":
        found = "a key that has a value already"
        return ConfigError(file, "", found, "each key once", int(line) if line else None)
    place = f"column {column}" if line else "the end"
    found = f"a line that is not TOML ({what[0].lower()}{what[1:]} at {place})"
    return ConfigError(file, "", found, LINES, int(line) if line else None)


def read_text(path: Path) -> str:
    """The text of a file.

    Raises:
        ConfigError: it cannot be read, or is not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(path, "", reason_of(error), "a readable file") from error
    except UnicodeDecodeError as error:
        raise ConfigError(path, "", "bytes that are not UTF-8", "a TOML file") from error
