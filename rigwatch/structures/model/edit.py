"""A structure with some of its coefficients changed: made unknown, guessed, damaged."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TypeVar

import msgspec

from rigwatch.structures.model.description import (
    DAMPER_PARTS,
    SPRING_PARTS,
    Coefficient,
    Structure,
    coefficient,
    coefficients,
    label,
)
from rigwatch.wire.errors import ModelError

T = TypeVar("T", bound=msgspec.Struct)


@dataclass(frozen=True)
class Change:
    """The change of one coefficient; None leaves an attribute unchanged."""

    value: float | None = None
    unknown: bool | None = None
    guess: float | None = None

    def applied(self, old: Coefficient) -> Coefficient:
        """The changed coefficient."""
        return msgspec.structs.replace(
            old,
            value=old.value if self.value is None else self.value,
            unknown=old.unknown if self.unknown is None else self.unknown,
            guess=old.guess if self.guess is None else self.guess,
        )


def changed(structure: Structure, changes: Mapping[str, Change]) -> Structure:
    """The structure with the coefficients named by `changes` changed.

    Raises:
        ModelError: a name is no coefficient of the structure.
    """
    require_known(structure, changes)
    nodes = {
        name: _edited(node, changes, {"mass": label("m", name)} | _starts(name))
        for name, node in structure.nodes.items()
    }
    springs = {
        name: _edited(item, changes, {part: name + end for part, end in SPRING_PARTS.items()})
        for name, item in structure.springs.items()
    }
    dampers = {
        name: _edited(item, changes, {part: name + end for part, end in DAMPER_PARTS.items()})
        for name, item in structure.dampers.items()
    }
    return msgspec.structs.replace(structure, nodes=nodes, springs=springs, dampers=dampers)


def with_values(structure: Structure, values: Mapping[str, float]) -> Structure:
    """The structure with new values of some coefficients."""
    return changed(structure, {name: Change(value=value) for name, value in values.items()})


def with_unknowns(
    structure: Structure, names: Iterable[str], guesses: Mapping[str, float] | None = None
) -> Structure:
    """The structure in which exactly `names` are unknown, with their guesses."""
    wanted, start = set(names), guesses or {}
    every = {name: Change(unknown=name in wanted) for name in coefficients(structure)}
    chosen = {n: Change(unknown=True, guess=start.get(n)) for n in wanted}
    return changed(structure, every | chosen)


def require_known(structure: Structure, names: Iterable[str]) -> None:
    """Raise a ModelError for a name that is no coefficient of the structure."""
    known = coefficients(structure)
    for name in names:
        if name not in known:
            close = get_close_matches(name, known, 3, 0.4)
            expected = f"such as {', '.join(close)}" if close else f"such as {next(iter(known))}"
            raise ModelError(
                f"{structure.name}: found the unknown {name!r}, expected a mass, spring, damper or"
                f" start, {expected}"
            )


def _starts(node: str) -> dict[str, str]:
    return {"x": f"{label('x', node)}(0)", "v": f"{label('v', node)}(0)"}


def _edited(item: T, changes: Mapping[str, Change], names: Mapping[str, str]) -> T:
    new = {
        part: changes[name].applied(coefficient(getattr(item, part)))
        for part, name in names.items()
        if name in changes
    }
    return msgspec.structs.replace(item, **new) if new else item
