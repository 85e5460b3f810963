"""Orders in which a signal passes an effect and what is at its port already.

A drive that is delayed and then saturates differs from one that saturates first, and a dead zone
behind a valve's play from one before it. An effect is therefore placed behind the accepted effects
at its port and before them, and on either side of each element that the healthy machine has there.
The score knows the first of these places only: for the small strengths that it asks about the
others hardly differ.
"""

from dataclasses import replace
from functools import lru_cache

from rigwatch.physics.engine.equations import (
    TIME,
    Effect,
    Placement,
    elements_at,
    names_in,
    parse,
    symbol,
)
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking.ranked import Ranked
from rigwatch.workbench.study import Study

Order = tuple[bool, str]
"""Place of an effect in the order: `Placement.ahead`, `Placement.beyond`."""


def order_of(placement: Placement) -> Order:
    """Place of an effect in the order at its port."""
    return placement.ahead, placement.beyond


def orders_at_port(study: Study, base: Fitted, row: Ranked) -> list[Placement]:
    """The effect in all orders that differ at its port, the one that was scored first.

    Args:
        study: with the elements of its base.
        base: a fit of it, with other effects.
        row: the effect.
    """
    if row.kind == "force":
        return [row.placement]
    found = list[Placement]()
    for element in ("", *_sides(study, base, row)):
        there = replace(row.placement, beyond=element)
        others = any(each.entry == there.entry for each in base.placements)
        found += [there, replace(there, ahead=True)] if others else [there]
    return found


def _sides(study: Study, base: Fitted, row: Ranked) -> list[str]:
    """The elements at a row's port on whose far side it makes a difference.

    What is computed at each sample is computed from what the port's channel itself brings.
    """
    if row.placement.effect.sampled:
        return []
    known = {each.name: each.effect for each in study.elements if each.port == row.port}
    names = [n for n in elements_at(base.compiled.system.model, row.port) if n in known]
    return [n for n in names if order_matters(known[n], row.placement.effect)]


def order_matters(one: Effect, other: Effect) -> bool:
    """Whether a signal that passes two effects depends on their order.

    It does not, but for the values of their parameters, if both are linear in it.
    """
    return not (_is_linear(*_equations(one)) and _is_linear(*_equations(other)))


def _equations(effect: Effect) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """All expressions of an effect, and the names in them that move with the signal."""
    states = effect.states.values()
    return (effect.expression, *(s.derivative or s.update for s in states)), (
        "u", *effect.states,
    )  # fmt: skip


@lru_cache(maxsize=256)
def _is_linear(texts: tuple[str, ...], moving: tuple[str, ...]) -> bool:
    """Whether expressions are a constant and a multiple of what moves, the same at all times."""
    names = set().union(*(names_in(text, "effect") for text in texts))
    if TIME in names:
        return False
    known = {name: symbol(name) for name in names | set(moving)}
    read = [parse(text, known, "effect") for text in texts]
    return all(
        expression.diff(known[a], known[b]) == 0
        for expression in read
        for a in moving
        for b in moving
    )
