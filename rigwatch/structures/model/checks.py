"""Refuses invalid structures before any computation, in one line that names the key."""

import re
from collections.abc import Iterator
from pathlib import Path

from rigwatch.structures.model.description import (
    Damper,
    Load,
    Spring,
    Structure,
    coefficient,
    label,
)
from rigwatch.structures.model.matrices import afloat
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import load

_NAME = re.compile(r"[A-Za-z0-9_]+")
_ENTRY = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def load_structure(path: Path | str) -> Structure:
    """The structure file at `path`, checked.

    Raises:
        ConfigError: it is malformed, or the structure is invalid (see `check`).
    """
    structure = load(path, Structure)
    check(structure, path)
    return structure


def check(structure: Structure, file: Path | str) -> None:
    """Refuse an invalid structure.

    Raises:
        ConfigError: a name is invalid, an end or a loaded node is unknown, a mass is not positive,
            a law lacks its length, a node is unconnected, or a part floats freely (rigid mode).
    """
    for key, found, expected in _complaints(structure):
        raise ConfigError(file, key, found, expected)


def _complaints(structure: Structure) -> Iterator[tuple[str, str, str]]:
    yield from _unfit_names(structure)
    yield from _bad_masses(structure)
    for name, spring in structure.springs.items():
        yield from _bad_ends(structure, f"springs.{name}.between", spring)
        if spring.law != "linear" and coefficient(spring.length).start <= 0:
            length = f"{coefficient(spring.length).start:g}"
            yield f"springs.{name}.length", length, f"a positive length for the law {spring.law}"
    for name, damper in structure.dampers.items():
        yield from _bad_ends(structure, f"dampers.{name}.between", damper)
    for name, entry in structure.loads.items():
        yield from _bad_load(structure, f"loads.{name}", entry)
    yield from _bad_signals(structure)
    yield from _loose_nodes(structure)


def _unfit_names(structure: Structure) -> Iterator[tuple[str, str, str]]:
    for name in structure.nodes:
        if not _NAME.fullmatch(name):
            yield f"nodes.{name}", repr(name), "a name of letters, digits and underscores"
    for table in ("springs", "dampers", "loads"):
        for name in getattr(structure, table):
            if not _ENTRY.fullmatch(name):
                yield f"{table}.{name}", repr(name), "a name that starts with a letter"
    taken = {label(kind, node) for node in structure.nodes for kind in "xvm"} | {"t"}
    for table in ("springs", "dampers"):
        for name in getattr(structure, table):
            if name in taken:
                yield f"{table}.{name}", repr(name), "a name that no other quantity has"
            taken.add(name)


def _bad_masses(structure: Structure) -> Iterator[tuple[str, str, str]]:
    for name, node in structure.nodes.items():
        mass = coefficient(node.mass)
        for number in (mass.value, mass.start):
            if not number > 0:
                yield f"nodes.{name}.mass", f"{number:g} kg", "a positive mass"


def _bad_ends(
    structure: Structure, key: str, item: Spring | Damper
) -> Iterator[tuple[str, str, str]]:
    for end in item.between:
        if end not in structure.nodes:
            yield key, f"node {end!r}", f"one of {', '.join(structure.nodes)}"
    if len(set(item.between)) < len(item.between):
        yield key, f"twice the node {item.between[0]!r}", "two different nodes, or one for ground"


def _bad_load(structure: Structure, key: str, load: Load) -> Iterator[tuple[str, str, str]]:
    if load.base == bool(load.node):
        found = "both a node and the base" if load.base else "neither a node nor the base"
        yield key, found, "node = ... or base = true"
    if load.node and load.node not in structure.nodes:
        yield f"{key}.node", f"node {load.node!r}", f"one of {', '.join(structure.nodes)}"
    if load.channel and not _ENTRY.fullmatch(load.channel):
        yield f"{key}.channel", repr(load.channel), "a name that starts with a letter"


def _bad_signals(structure: Structure) -> Iterator[tuple[str, str, str]]:
    known = [label(kind, node) for kind in "xva" for node in structure.nodes]
    for signal in structure.observed:
        if signal not in known:
            yield "observed", repr(signal), f"one of {', '.join(known)}"


def _loose_nodes(structure: Structure) -> Iterator[tuple[str, str, str]]:
    """Refuse nodes without a spring, and groups of nodes that no spring connects to ground."""
    held = {end for spring in structure.springs.values() for end in spring.between}
    for name in structure.nodes:
        if name not in held:
            yield f"nodes.{name}", "no spring at this node", "at least one that holds it"
    for group in afloat(structure):
        yield (
            "springs",
            f"a free rigid mode: node{'s' if len(group) > 1 else ''} {', '.join(group)} can drift"
            " off together",
            "a spring from one of them to ground",
        )
