"""Prints docs/configuration.md from the structs that read the files: `make docs` writes it.

A key's description stands beside its type in the code; here it only becomes a table, so that the
page cannot say anything else than the program does.
"""

import math
from collections.abc import Iterator
from typing import Any, cast

import msgspec
from msgspec import inspect

from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.typed_files.loading import Section
from rigwatch.witness.people import PeopleFile
from sim_plant.scenario import Scenario

PAGES: tuple[tuple[str, str, type[Section]], ...] = (
    (
        "Configuration of a rig",
        "One TOML file read by all processes of a rig: `rigwatch up CONFIG`. Relative paths are "
        "relative to the folder in which the command runs. A key that is misspelt, missing or out "
        "of range stops the command with one line that names file, line and key.",
        RigConfig,
    ),
    (
        "People",
        "The file named by `witness.people`: who is notified of alarms, and when nobody is. It "
        "holds passwords, so only its owner should be able to read it. It is read again when it "
        "changes ([operations](operations.md#notifications-and-heartbeats)).",
        PeopleFile,
    ),
    (
        "Scenario of the simulated rig",
        "The file named by `plant.scenario`: the rig, its excitation and its events.",
        Scenario,
    ),
)


def page() -> str:
    """The whole page."""
    head = "<!-- Printed by `make docs` from the descriptions in the code. -->\n"
    return head + "\n".join(
        f"\n# {title}\n\n{text}\n\n" + "\n".join(sections(kind)) for title, text, kind in PAGES
    )


def undocumented() -> list[str]:
    """Keys without a description, and sections without a docstring."""
    found = []
    for _, _, root in PAGES:
        for kind in _structs(root):
            found += [
                f"{kind.__name__}.{field.encode_name}"
                for field in _fields(kind)
                if not _description(field.type)
            ]
            found += [] if kind.__doc__ else [kind.__name__]
    return found


def sections(
    root: type[Section], level: int = 2, printed: set[type[Section]] | None = None
) -> Iterator[str]:
    """The struct and all that its fields may hold: a heading, a text and a table each.

    Args:
        root: of a file.
        level: of the headings.
        printed: structs that the page has already, which are left out; the new ones are added.
    """
    printed = set() if printed is None else printed
    for kind in _structs(root):
        if kind in printed:
            continue
        printed.add(kind)
        first, _, rest = (kind.__doc__ or "").partition("\n")
        summary = first.strip().rstrip(".")
        if kind is root or " — " in summary:
            yield f"{'#' * level} {summary}\n"
        else:
            yield f"{'#' * level} {kind.__name__}\n\n{summary}.\n"
        yield from _text(rest)
        yield "| key | type | default | |"
        yield "| --- | --- | --- | --- |"
        for field in _fields(kind):
            cells = (
                f"`{field.encode_name}`",
                _type_name(field.type),
                _default(field),
                _description(field.type),
            )
            yield f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
        yield ""


def _text(rest: str) -> Iterator[str]:
    """The docstring's further paragraphs, without the list of attributes."""
    body = rest.partition("Attributes:")[0].strip()
    if body:
        yield " ".join(body.split()) + "\n"


def _structs(root: type[Section]) -> list[type[Section]]:
    """The struct and all that its fields may hold, each once, in the order of a file."""
    found: list[type[Section]] = []

    def visit(kind: type[Section]) -> None:
        if kind not in found:
            found.append(kind)
            for field in _fields(kind):
                for inner in _inner_structs(field.type):
                    visit(inner)

    visit(root)
    return found


def _fields(kind: type[Section]) -> tuple[inspect.Field, ...]:
    info = inspect.type_info(kind)
    assert isinstance(info, inspect.StructType)
    return info.fields


def _plain(kind: Any) -> Any:
    return kind.type if isinstance(kind, inspect.Metadata) else kind


def _inner_structs(kind: Any) -> Iterator[type[Section]]:
    kind = _plain(kind)
    if isinstance(kind, inspect.StructType):
        yield cast(type[Section], kind.cls)
    elif isinstance(kind, inspect.UnionType):
        for option in kind.types:
            yield from _inner_structs(option)
    elif isinstance(kind, inspect.VarTupleType | inspect.ListType):
        yield from _inner_structs(kind.item_type)
    elif isinstance(kind, inspect.DictType):
        yield from _inner_structs(kind.value_type)


def _description(kind: Any) -> str:
    if isinstance(kind, inspect.Metadata):
        schema = kind.extra_json_schema or {}
        return str(schema.get("description") or _description(kind.type))
    return ""


_NAMES: dict[type, str] = {
    inspect.StrType: "text",
    inspect.BoolType: "boolean",
    inspect.IntType: "integer",
    inspect.FloatType: "number",
    inspect.DateTimeType: "date-time",
    inspect.TimeType: "time",
    inspect.NoneType: "",
}


def _type_name(kind: Any) -> str:
    match _plain(kind):
        case inspect.StructType(cls=struct):
            first = (struct.__doc__ or "").partition("\n")[0]
            plain = struct.__name__
            name = first.partition(" — ")[0] if " — " in first else f"[{plain}](#{plain.lower()})"
        case inspect.LiteralType(values=values):
            name = " / ".join(f"`{value}`" for value in values)
        case inspect.UnionType(types=options):
            name = " / ".join(filter(None, map(_type_name, options)))
        case inspect.VarTupleType(item_type=item) | inspect.ListType(item_type=item):
            name = f"list of {_type_name(item)}"
        case inspect.TupleType(item_types=items):
            name = f"{len(items)} × {_type_name(items[0])}"
        case inspect.DictType(value_type=value):
            name = f"table of {_type_name(value)}"
        case other:
            name = _NAMES.get(type(other), type(other).__name__) + _limits(other)
    return name


def _limits(kind: Any) -> str:
    signs = {"gt": "> ", "ge": "≥ ", "lt": "< ", "le": "≤ "}
    parts = [
        f"{sign}{limit:g}"
        for name, sign in signs.items()
        if (limit := getattr(kind, name, None)) is not None
    ]
    return f" ({', '.join(parts)})" if parts else ""


def _default(field: inspect.Field) -> str:
    if field.required:
        return "required"
    if field.default is msgspec.NODEFAULT:
        one = isinstance(_plain(field.type), inspect.StructType)
        return "the section's own" if one else "empty"
    if field.default in (None, math.inf, -math.inf):
        return "none"
    return f"`{msgspec.json.encode(field.default).decode()}`"
