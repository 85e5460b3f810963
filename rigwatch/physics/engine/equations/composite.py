"""Composites: an effect that acts through another, as friction behind play or a delay after a lag.

    [maps.play]                       # what lies between a force port and an effect
    variables.v = "…"                 # what the effect sees in place of the port's v

    [composites.coulomb_behind_play]
    first = "play"
    then = "coulomb"

At a force port `first` is a map of the port's variables and `then` an effect that sees the mapped
ones; it has the strength. At a signal port both are effects and the signal passes them in order; a
switch is the strength, so both vanish together. The result is a plain effect, compiled and ranked
like any other. Names used by both parts get the part's name in front.
"""

import re
from collections.abc import Mapping
from typing import Annotated

from msgspec import Meta, field
from msgspec.structs import replace

from rigwatch.physics.engine.equations.effect import (
    Effect,
    EffectParameter,
    EffectState,
    Text,
)
from rigwatch.physics.engine.equations.expression import renamed
from rigwatch.wire.errors import ConfigError
from rigwatch.wire.typed_files import Section

SWITCH = "through"
"""Name of the switch of two effects in series at a signal."""
_TIMED = ("rate", "step", "left")
"""Names that only the port's own signal has."""


class EffectMap(Section, frozen=True, kw_only=True):
    """What lies between a force port and an effect: the variables as the effect sees them."""

    variables: Annotated[
        dict[str, Text], Meta(min_length=1, description="what is seen in place of a variable")
    ]
    physics: Annotated[Text, Meta(description="the physics in a sentence")]
    parameters: dict[str, EffectParameter] = field(default_factory=dict)
    states: dict[str, EffectState] = field(default_factory=dict)


class Composite(Section, frozen=True, kw_only=True):
    """Two effects in series, or an effect behind a map."""

    first: Annotated[str, Meta(description="what is passed first: a map, or an effect of a signal")]
    then: Annotated[str, Meta(description="effect that sees what has passed the first")]
    physics: Annotated[Text, Meta(description="the physics in a sentence")]
    source: Annotated[Text, Meta(description="where it is from")]
    family: Annotated[str, Meta(description="as for effects")] = ""
    confused_with: Annotated[tuple[str, ...], Meta(description="as for effects")] = ()
    refines: Annotated[str, Meta(description="as for effects")] = ""
    elective: Annotated[bool, Meta(description="as for effects")] = True
    tried: Annotated[
        dict[str, tuple[float, ...]],
        Meta(description="values tried by the score test, by parameter of the composite"),
    ] = field(default_factory=dict)


def composed(
    name: str,
    own: Composite,
    effects: Mapping[str, Effect],
    maps: Mapping[str, EffectMap],
    file: object,
) -> Effect:
    """The composite as a plain effect.

    Args:
        name: of the composite.
        own: its declaration.
        effects, maps: by name, those that it may name.
        file: for errors.

    Raises:
        ConfigError: a part is unknown, or cannot be in this place.
    """
    where = f"composites.{name}"
    then = _known(own.then, effects, f"{where}.then", "an effect", file)
    if own.first in maps:
        made = _behind(own, maps[own.first], then, where, file)
    else:
        first = _known(own.first, effects, f"{where}.first", "a map or an effect", file)
        made = _in_series(own, first, then, where, file)
    for key in own.tried:
        if key not in made.parameters:
            expected = f"one of {', '.join(made.parameters)}"
            raise ConfigError(str(file), f"{where}.tried", repr(key), expected)
    parameters = {
        key: replace(p, tried=own.tried.get(key, p.tried)) for key, p in made.parameters.items()
    }
    return replace(made, parameters=parameters)


def _known(
    name: str, effects: Mapping[str, Effect], key: str, expected: str, file: object
) -> Effect:
    if name not in effects:
        raise ConfigError(str(file), key, repr(name), f"the name of {expected}")
    return effects[name]


def _behind(own: Composite, first: EffectMap, then: Effect, where: str, file: object) -> Effect:
    """An effect of a force port that sees mapped variables."""
    if then.port != "force":
        raise ConfigError(
            str(file), f"{where}.then", f"{own.then} of kind {then.port}", "one of kind force"
        )
    ours, theirs = _names(own, first, then)
    seen = {name: f"({renamed(text, ours)})" for name, text in first.variables.items()}
    if unseen := _variables(then) - set(seen):
        raise ConfigError(
            str(file), f"{where}.first", f"no {min(unseen)} in {own.first}, which {own.then} uses",
            "a map with it",
        )  # fmt: skip
    return _effect(
        own,
        then,
        expression=renamed(then.expression, theirs | seen),
        direction=renamed(then.direction, theirs | seen),
        parameters=_taken(first.parameters, ours) | _taken(then.parameters, theirs),
        states=_states(first.states, ours) | _states(then.states, theirs | seen),
    )


def _in_series(own: Composite, first: Effect, then: Effect, where: str, file: object) -> Effect:
    """Two effects that a signal passes in order, with a switch as their common strength."""
    for key, part, name in (("first", first, own.first), ("then", then, own.then)):
        expected = "an effect of a signal without samples of its own"
        if part.port == "force" or part.sampled:
            raise ConfigError(str(file), f"{where}.{key}", repr(name), expected)
    if timed := _used(then) & set(_TIMED):
        raise ConfigError(
            str(file), f"{where}.then", f"{own.then}, which uses {min(timed)}", "one without"
        )
    ours, theirs = _names(own, first, then)
    leaves = {"u": f"({renamed(first.expression, ours)})"}
    after = renamed(then.expression, theirs | leaves)
    port = first if first.port != "signal" else then
    return _effect(
        own,
        port,
        expression=f"u + {SWITCH}*(({after}) - u)",
        direction="",
        parameters={SWITCH: EffectParameter(unit="1", role="switch")}
        | _shapes(_taken(first.parameters, ours))
        | _shapes(_taken(then.parameters, theirs)),
        states=_states(first.states, ours) | _states(then.states, theirs | leaves),
    )


def _effect(  # noqa: PLR0917 -- the parts of one effect
    own: Composite,
    like: Effect,
    expression: str,
    direction: str,
    parameters: dict[str, EffectParameter],
    states: dict[str, EffectState],
) -> Effect:
    return Effect(
        port=like.port, expression=expression, direction=direction, physics=own.physics,
        source=own.source, family=own.family, confused_with=own.confused_with,
        refines=own.refines, elective=own.elective, parameters=parameters, states=states,
    )  # fmt: skip


def _names(
    own: Composite, first: Effect | EffectMap, then: Effect
) -> tuple[dict[str, str], dict[str, str]]:
    """New names of the parameters and states of both parts."""
    ours, theirs = ({*part.parameters, *part.states} for part in (first, then))
    taken = {SWITCH, *(first.variables if isinstance(first, EffectMap) else ())}
    both = ours & theirs | (ours | theirs) & taken
    return (
        {n: f"{own.first}_{n}" if n in both else n for n in ours},
        {n: f"{own.then}_{n}" if n in both else n for n in theirs},
    )


def _taken(
    parameters: Mapping[str, EffectParameter], names: Mapping[str, str]
) -> dict[str, EffectParameter]:
    return {names[name]: p for name, p in parameters.items()}


def _shapes(parameters: Mapping[str, EffectParameter]) -> dict[str, EffectParameter]:
    """Parameters of which none is the strength; a switch of a part stays on."""
    return {
        name: replace(p, role="shape")
        if p.role == "strength"
        else replace(p, role="constant", value=1.0)
        if p.role == "switch"
        else p
        for name, p in parameters.items()
    }


def _states(states: Mapping[str, EffectState], names: Mapping[str, str]) -> dict[str, EffectState]:
    return {
        names[name]: replace(state, derivative=renamed(state.derivative, names))
        for name, state in states.items()
    }


def _used(effect: Effect) -> set[str]:
    """All names in an effect's equations."""
    texts = (effect.expression, *(s.derivative + s.update for s in effect.states.values()))
    return {name for text in texts for name in re.findall(r"\b[A-Za-z_]\w*", text)}


def _variables(effect: Effect) -> set[str]:
    """The motion that an effect uses: what lies in between maps it."""
    return _used(effect) & {"x", "v"}
