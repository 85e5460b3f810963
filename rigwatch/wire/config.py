"""Typed TOML files: configuration, scenarios and models are structs, and a wrong file is told so in one line.

`load` reads a file into a msgspec struct. A key that is misspelt, missing, of the wrong type or out of range becomes a
`ConfigError` with file, line, key, what was found and what was expected.
"""

import difflib
import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from rigwatch.wire.errors import ConfigError

S = TypeVar("S", bound="Section")
_PATH = re.compile(r" - at `\$(?P<path>[^`]*)`$")
_UNKNOWN = re.compile(r"Object contains unknown field `(?P<key>[^`]+)`")
_MISSING = re.compile(r"Object missing required field `(?P<key>[^`]+)`")


class Section(msgspec.Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """Base of every struct that is read from a TOML file: frozen, and unknown keys are errors."""


def load(path: Path | str, kind: type[S]) -> S:
    """The file at `path` as a struct of class `kind`.

    Raises:
        ConfigError: the file cannot be read, is not TOML, or does not fit `kind`.
    """
    return parse(_read(Path(path)), kind, path)


def parse(text: str, kind: type[S], file: Path | str) -> S:
    """The TOML `text` as a struct of class `kind`; `file` is named in errors.

    Raises:
        ConfigError: the text is not TOML or does not fit `kind`.
    """
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(file, "", str(error), "TOML") from error
    try:
        return msgspec.convert(raw, kind)
    except msgspec.ValidationError as error:
        raise _explained(str(error), raw, kind, text, file) from None


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(path, "", error.strerror or str(error), "a readable file") from error
    except UnicodeDecodeError as error:
        raise ConfigError(path, "", "bytes that are not UTF-8", "a TOML file") from error


def _explained(
    complaint: str, raw: dict[str, Any], kind: type[Section], text: str, file: Path | str
) -> ConfigError:
    at = _PATH.search(complaint)
    path = at["path"].lstrip(".") if at else ""
    reason = complaint[: at.start()] if at else complaint
    for pattern, found in ((_UNKNOWN, "an unknown key"), (_MISSING, "no such key")):
        if match := pattern.search(reason):
            key = f"{path}.{match['key']}".lstrip(".")
            expected = _near(match["key"], path, kind) if pattern is _UNKNOWN else "a value for it"
            return ConfigError(file, key, found, expected, _line(text, key))
    return ConfigError(file, path, repr(_at(raw, path)), _lower(reason), _line(text, path))


def _lower(reason: str) -> str:
    return reason.removeprefix("Expected ").split(", got ")[0].replace("`", "")


def _at(raw: Any, path: str) -> Any:
    for name, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", path):
        try:
            raw = raw[int(index)] if index else raw[name]
        except (KeyError, IndexError, TypeError):
            return None
    return raw


def _near(key: str, path: str, kind: type[Section]) -> str:
    known = _known_keys(kind, path)
    close = difflib.get_close_matches(key, known, 1)
    return f"{close[0]!r}?" if close else f"one of {', '.join(known)}" if known else "no such key"


def _known_keys(kind: type[Section], path: str) -> list[str]:
    """Keys of the struct at `path`, followed through the annotations as far as they are plain."""
    current: Any = msgspec.inspect.type_info(kind)
    for name in re.findall(r"[^.\[\]]+", re.sub(r"\[[^\]]*\]", "", path)):
        fields = {field.encode_name: field.type for field in getattr(current, "fields", ())}
        current = _struct_within(fields.get(name))
    return [field.encode_name for field in getattr(current, "fields", ())]


def _struct_within(info: Any) -> Any:
    """The first struct in a field's type: itself, an item of a list or mapping, or a choice."""
    if info is None or isinstance(info, msgspec.inspect.StructType):
        return info
    parts = [getattr(info, name, None) for name in ("item_type", "value_type")]
    parts += list(getattr(info, "types", ()))
    return next((found for part in parts if (found := _struct_within(part))), None)


def _line(text: str, path: str) -> int | None:
    """The line on which the key at `path` stands, where a search of the text finds it."""
    names = re.findall(r"[^.\[\]]+", re.sub(r"\[\d*\.*\]", "", path))
    if not names:
        return None
    section, key = ".".join(names[:-1]), re.escape(names[-1])
    header = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if match := re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line):
            header = match[1].replace('"', "")
            if header == ".".join(names):
                return number
        elif header == section and re.match(rf"\s*[\"']?{key}[\"']?\s*=", line):
            return number
    return None
