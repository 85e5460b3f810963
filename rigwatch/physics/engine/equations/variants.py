"""Variants of a model: alternative laws for a part of it, as tables that replace its own.

    [variants.isothermal]
    physics = "The chambers' walls keep the air at room temperature."
    group = "heat"
    parameters.n = { value = 1.0, unit = "1", fixed = true }

An entry of a variant replaces the model's entry of the same name, or is added; `without` removes
states and parameters. At most one variant of a group is used, and no two change the same entry.
"""

from collections.abc import Iterable, Sequence
from typing import Any

from msgspec.structs import replace

from rigwatch.physics.engine.equations.model import Model, Variant
from rigwatch.wire.errors import ModelError

TABLES = ("parameters", "quantities", "states", "outputs")


def with_variants(model: Model, names: Sequence[str]) -> Model:
    """The model with some of its variants.

    Args:
        model: the unmodified model.
        names: of variants, in any order.

    Raises:
        ModelError: a variant is unknown, or two of them exclude each other.
    """
    for count, name in enumerate(names):
        if name not in model.variants:
            known = ", ".join(model.variants) or "none, as the model has no variants"
            raise ModelError(f"{model.name}: found variant {name!r}, expected {known}")
        rival = next((n for n in names[:count] if excludes(model, name, n)), None)
        if rival is not None:
            raise ModelError(
                f"{model.name}: found variants {rival} and {name}, expected one of them, as both"
                " change the same part"
            )
    for name in names:
        model = _changed(model, model.variants[name])
    return model


def excludes(model: Model, one: str, other: str) -> bool:
    """Whether two variants exclude each other: same group, or a change of the same entry."""
    a, b = model.variants[one], model.variants[other]
    return one == other or (a.group != "" and a.group == b.group) or bool(_touched(a) & _touched(b))


def neighbours(model: Model, names: Sequence[str]) -> list[tuple[str, ...]]:
    """Sets of variants one step away: each further variant added, replacing those that it excludes.

    Args:
        model: the unmodified model.
        names: of the variants in use.
    """
    return [
        (*(n for n in names if not excludes(model, name, n)), name)
        for name in model.variants
        if name not in names
    ]


def _touched(variant: Variant) -> set[str]:
    named = (name for table in TABLES for name in getattr(variant, table))
    return {*named, *variant.without}


def _changed(model: Model, variant: Variant) -> Model:
    tables = {table: _left(getattr(model, table), variant.without) for table in TABLES}
    return replace(model, **{n: own | getattr(variant, n) for n, own in tables.items()})


def _left(table: dict[str, Any], without: Iterable[str]) -> dict[str, Any]:
    return {name: entry for name, entry in table.items() if name not in set(without)}
