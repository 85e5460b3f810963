"""Compatibility of effects with ports, and valid signs of their strengths."""

import re
from string import Formatter

from rigwatch.physics.engine.equations import LEFT, RATE, Effect, Model, Port, hold_at, names_in
from rigwatch.physics.engine.score.candidates import Candidate
from rigwatch.wire.units import unit_of

_SPEEDS = tuple(unit_of(unit).dimension for unit in ("m/s", "rad/s"))


BEYOND = 10.0
"""Ratio of a strength as a score estimates it to its bound up to which it may be within."""


def suits(effect: Effect, port: Port, model: Model) -> bool:
    """Whether the effect is compatible with the port and the port has all its variables."""
    if not effect.fits(port.kind) or effect.family in port.described:
        return False
    if effect.sampled and port.kind == "actuator" and hold_at(model, port) != "zero":
        return False
    if port.passive and not _named(effect) & set(port.variables):
        return False
    return has_variables(effect, port) and _units_named(effect) <= _variables_with_scale(port)


def has_variables(effect: Effect, port: Port) -> bool:
    """Whether the port has all the variables that the effect's equations use."""
    own = {
        *effect.parameters,
        *effect.states,
        "t",
        RATE,
        LEFT,
        *({"u"} if port.kind != "force" else ()),
    }
    return _named(effect) - own <= set(port.variables)


def variables_read(effect: Effect) -> frozenset[str]:
    """Variables of a port that the effect's equations, units or scales use."""
    own = {*effect.parameters, *effect.states, "t", RATE, LEFT, "u", "F"}
    return (_named(effect) | _units_named(effect)) - own


def _variables_with_scale(port: Port) -> set[str]:
    """Variables whose unit and size follow from a port's: a distance follows from a speed."""
    names = {*port.variables, "F" if port.kind == "force" else "u"}
    return names | ({"x"} if _has_speed(port) else set())


def _has_speed(port: Port) -> bool:
    """Whether `v` is a speed or an angular rate; a voltage is the rate of no distance."""
    found = port.variables.get("v")
    return found is not None and unit_of(found.unit).dimension in _SPEEDS


def _units_named(effect: Effect) -> set[str]:
    """Variables of the port used in units and scales of an effect."""
    units = [p.unit for p in effect.parameters.values()]
    units += [s.unit for s in effect.states.values()]
    in_units = {field for unit in units for _, field, _, _ in Formatter().parse(unit) if field}
    scales = " ".join(p.scale for p in effect.parameters.values())
    return (in_units | set(re.findall(r"[A-Za-z_]\w*", scales))) - {"dt", "rate"}


def _named(effect: Effect) -> frozenset[str]:
    """All names in an effect's equations except functions."""
    texts = [effect.expression, *(s.derivative or s.update for s in effect.states.values())]
    return frozenset().union(*(names_in(text, "effect") for text in texts))


def possible(candidate: Candidate, strength: float) -> bool:
    """Whether the strength that a score estimates has a sign, and about a size, within its bounds.

    Where other parameters have followed what is missing, it is several times too large: that of a
    delay of some samples is beyond a hundred of them.
    """
    p = candidate.effect.parameters[candidate.effect.strength]
    if p.role == "switch":
        return strength > 0
    furthest = max(p.high - p.neutral, 0.0) if strength > 0 else max(p.neutral - p.low, 0.0)
    return abs(strength) <= BEYOND * furthest
