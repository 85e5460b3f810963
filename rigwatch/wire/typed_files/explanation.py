"""Turns a validation error of msgspec into one line for the author of a TOML file.

msgspec names the place as a path such as `$.channels[0].gain`, with `[...]` for a key of a mapping.
The path is followed through the data and the schema together, so that the error can show what was
found, which keys are known there, and the line in the file.
"""

import difflib
import re
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files.prepared import as_kind
from rigwatch.wire.units import UnitError

_PLACE = re.compile(r" - at `(?:key in )?\$(?P<path>[^`]*)`$")
_UNKNOWN = re.compile(r"Object contains unknown field `(?P<key>[^`]+)`")
_MISSING = re.compile(r"Object missing required field `(?P<key>[^`]+)`")
_HEADER = re.compile(r"\s*\[(?P<array>\[)?\s*(?P<name>[^\]]+?)\s*\]")
TYPES = {
    "int": "a whole number",
    "float": "a number",
    "str": "text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
}
"""Types as the author of a file calls them."""
_TYPE = re.compile(rf"\b({'|'.join(TYPES)})\b")
_STEP = re.compile(r"\.?([^.\[\]]+)|\[(\d+|\.\.\.)\]")


def explained(
    error: msgspec.ValidationError,
    raw: Any,
    kind: type[msgspec.Struct],
    text: str,
    file: Path | str,
) -> ConfigError:
    """The error for msgspec's message about `raw`, read from `text` of `file`."""
    complaint = str(error)
    place = _PLACE.search(complaint)
    reason = complaint[: place.start()] if place else complaint
    path, value, schema = _follow(place["path"] if place else "", raw, kind)
    if match := _UNKNOWN.search(reason):
        key, expected = _below(path, match["key"]), _near(match["key"], schema, value)
        return ConfigError(file, key, "an unknown key", expected, line_of(text, key))
    if match := _MISSING.search(reason):
        key, meaning = _below(path, match["key"]), _meaning(match["key"], schema, value)
        expected = "one: it is required" + (f" ({meaning})" if meaning else "")
        return ConfigError(file, key, "no value", expected, line_of(text, path))
    if isinstance(error.__cause__, UnitError):
        unit, key = error.__cause__, _below(path, "unit")
        return ConfigError(file, key, unit.found, unit.expected, line_of(text, key))
    return ConfigError(file, path, _shown(value), _expected(reason, schema), line_of(text, path))


def _below(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _expected(reason: str, schema: Any) -> str:
    if isinstance(schema, msgspec.inspect.UnionType) and reason.startswith("Invalid value"):
        return f"one of {', '.join(sorted(struct.tag for struct in _structs(schema)))}"
    if isinstance(schema, msgspec.inspect.LiteralType):
        return f"one of {', '.join(str(value) for value in schema.values)}"
    return _in_words(reason.removeprefix("Expected ").split(", got ")[0].replace("`", ""))


def _in_words(expected: str) -> str:
    """What msgspec expects, such as "int >= 1", with words for the names of types."""
    types, pattern, regex = expected.partition(" matching regex ")
    types = types.removesuffix(" | null")  # TOML has none
    named = _TYPE.sub(lambda match: TYPES[match[0]], types).replace(" | ", " or ")
    return f"{named} matching {regex}" if pattern else named


def _near(key: str, schema: Any, value: Any) -> str:
    known = list(_fields(schema, value))
    close = difflib.get_close_matches(key, known, 1)
    return f"{close[0]!r}" if close else f"one of {', '.join(known)}"


def _follow(pattern: str, value: Any, kind: type[msgspec.Struct]) -> tuple[str, Any, Any]:
    """The dotted path of `pattern` in the data, the value there and its schema."""
    schema: Any = msgspec.inspect.type_info(kind)
    path = ""
    for name, index in _STEP.findall(pattern):
        if index.isdigit():
            schema, value, path = _plain(schema.item_type), value[int(index)], f"{path}[{index}]"
        elif index:
            schema = _plain(schema.value_type)
            key = _refused(value, schema)
            path, value = _below(path, key), value.get(key)
        else:
            # The tag of a union of structs is not a field: it selects the struct.
            schema = _plain(_fields(schema, value).get(name, schema))
            path, value = _below(path, name), value.get(name)
    return path, value, schema


def _plain(schema: Any) -> Any:
    """The schema without its description, and without the None of an optional key."""
    while isinstance(schema, msgspec.inspect.Metadata):
        schema = schema.type
    if isinstance(schema, msgspec.inspect.UnionType):
        choices = [c for c in schema.types if not isinstance(c, msgspec.inspect.NoneType)]
        return _plain(choices[0]) if len(choices) == 1 else schema
    return schema


def _refused(mapping: dict[str, Any], schema: Any) -> str:
    """The first key of `mapping` whose value the schema refuses."""
    target = getattr(schema, "cls", None) or object
    for key, value in mapping.items():
        try:
            as_kind(value, target)
        except msgspec.ValidationError:
            return key
    return next(iter(mapping))


def _structs(schema: Any) -> list[Any]:
    """The structs that `schema` allows: itself, or those of a choice."""
    choices = getattr(schema, "types", (schema,))
    return [choice for choice in choices if isinstance(choice, msgspec.inspect.StructType)]


def _fields(schema: Any, value: Any) -> dict[str, Any]:
    """Schemas by key of the struct selected by the tag of `value`."""
    structs = _structs(schema)
    tagged = [s for s in structs if s.tag is not None and value.get(s.tag_field) == s.tag]
    chosen = tagged or [struct for struct in structs if struct.tag is None]
    return {field.encode_name: field.type for struct in chosen for field in struct.fields}


def _meaning(key: str, schema: Any, value: Any) -> str:
    """What the schema says of a key, "" if nothing."""
    told = getattr(_fields(schema, value).get(key), "extra_json_schema", None) or {}
    return str(told.get("description", ""))


def line_of(text: str, path: str) -> int | None:
    """The line of the key at `path`, if it can be found by a plain search."""
    table, _, key = path.rpartition(".")
    here, counts = "", Counter[str]()
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            here = _counted(header["name"], counts) if header["array"] else header["name"]
            if here == path:
                return number
        elif here == table and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
            return number
    return None


def _counted(name: str, counts: Counter[str]) -> str:
    """The path of the next table of the array `name`, such as "channels[2]"."""
    counts[name] += 1
    return f"{name}[{counts[name] - 1}]"
