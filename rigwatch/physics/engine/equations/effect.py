"""An effect: physics that a model may be missing, as an expression at a port.

Each effect is a short declaration in a TOML file. At a force port the expression is the added force
as a function of the port's `x` and `v`; at an actuator or sensor it is the output signal as a
function of the input signal `u`. The effect vanishes when the parameter with role "strength" is at
its neutral value.

Values are numbers, or multiples of the `scale` of a signal in the recording. Units may refer to the
port's own: `{F}`, `{x}`, `{v}` at a force, `{u}` at a signal, so one declaration serves a mass on a
table and an electronic oscillator. Numbers are given in the unit next to them and converted to SI:
immediately if the unit is fixed, by `Effect.at` if it refers to the port's.
"""

from collections.abc import Mapping
from typing import Annotated, Literal, TypeVar

import sympy
from msgspec import Meta, field
from msgspec.structs import replace

from rigwatch.physics.engine.equations.expression import parse as parse_expression
from rigwatch.physics.engine.equations.in_si import into_si
from rigwatch.wire.errors import ModelError
from rigwatch.wire.typed_files import Section
from rigwatch.wire.units import UnitError, simplified, unit_of

Text = Annotated[str, Meta(min_length=1)]

_VALUES = ("value", "low", "high", "tried", "neutral")
"""Number fields of a parameter without scale; with a scale they are relative to it, in SI."""


class EffectParameter(Section, frozen=True, kw_only=True):
    """A number of an effect."""

    unit: Annotated[str, Meta(description="its unit; may refer to the port's units in braces")]
    value: Annotated[float, Meta(description="initial value in a fit, relative to `scale`")] = 0.0
    low: Annotated[float, Meta(description="lower bound")] = float("-inf")
    high: Annotated[float, Meta(description="upper bound")] = float("inf")
    role: Annotated[
        Literal["strength", "switch", "shape", "constant"],
        Meta(
            description="a strength vanishes with the effect; a switch does, too, and is 1 in a"
            " fit; a constant is never fitted"
        ),
    ] = "shape"
    neutral: Annotated[float, Meta(description="strength at which the effect is absent")] = 0.0
    tried: Annotated[
        tuple[float, ...], Meta(description="shape values tried by the score test")
    ] = ()
    scale: Annotated[
        str,
        Meta(description="unit of values and bounds: x, v, u, dt or a ratio of them"),
    ] = ""
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""

    def __post_init__(self) -> None:
        into_si(self, *(("neutral",) if self.scale else _VALUES))


class EffectState(Section, frozen=True, kw_only=True):
    """State of an effect: it has a rate of change, or is updated at each sample."""

    unit: Annotated[str, Meta(description="its unit")]
    derivative: Annotated[str, Meta(description="its rate of change")] = ""
    update: Annotated[
        str, Meta(description="value after each sample, from its last value and the input")
    ] = ""
    start: Annotated[float, Meta(description="value to start from")] = 0.0
    low: Annotated[float, Meta(description="least that it can hold")] = float("-inf")
    high: Annotated[float, Meta(description="most that it can hold")] = float("inf")
    known: Annotated[
        bool,
        Meta(
            description="starts at `start` in each recording and is not fitted, such as the path"
            " since its beginning"
        ),
    ] = False
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""

    def __post_init__(self) -> None:
        into_si(self, "start", "low", "high")


class Effect(Section, frozen=True, kw_only=True):
    """One effect of the library."""

    port: Annotated[Literal["force", "actuator", "sensor", "signal"], Meta(description="where")]
    expression: Annotated[Text, Meta(description="added force, or output signal")]
    direction: Annotated[
        str, Meta(description="derivative by the strength at neutral, if not computable")
    ] = ""
    physics: Annotated[Text, Meta(description="the physics in a sentence")]
    source: Annotated[Text, Meta(description="where it is from")]
    family: Annotated[
        str,
        Meta(description="effects of one family are equivalent descriptions; its name if empty"),
    ] = ""
    confused_with: Annotated[
        tuple[str, ...], Meta(description="effects that are similar on many recordings")
    ] = ()
    refines: Annotated[
        str, Meta(description="effect of lower order, tried first if it explains most of the same")
    ] = ""
    time_shift: Annotated[
        bool, Meta(description="only delays: between one input and one output its port is unknown")
    ] = False
    delays: Annotated[
        str,
        Meta(
            description="parameter by which the effect only delays its signal; what is held between"
            " samples is then delayed exactly, without states"
        ),
    ] = ""
    elective: Annotated[
        bool, Meta(description="ranked only in studies that say whole_library = true")
    ] = False
    parameters: dict[str, EffectParameter]
    states: dict[str, EffectState] = field(default_factory=dict)

    def fits(self, kind: str) -> bool:
        """Whether it is compatible with a port of this kind."""
        return self.port == kind or (self.port == "signal" and kind in ("actuator", "sensor"))

    @property
    def strength(self) -> str:
        """Name of the strength parameter."""
        roles = ("strength", "switch")
        return next(name for name, p in self.parameters.items() if p.role in roles)

    @property
    def sampled(self) -> bool:
        """Whether it acts on samples, like a digital filter."""
        return any(state.update for state in self.states.values())

    @property
    def free(self) -> int:
        """Number of parameters that a fit estimates."""
        return sum(p.role in ("strength", "shape") for p in self.parameters.values())

    def at(self, units: Mapping[str, str], where: str) -> "Effect":
        """The effect at a port: references in its units resolved, its numbers in SI.

        Args:
            units: the port's own units as written, by the name used in braces.
            where: description for error messages.

        Raises:
            ModelError: a unit is unknown, or the port lacks a unit named in braces.
        """
        parameters = {name: _filled(p, units, where) for name, p in self.parameters.items()}
        states = {name: _filled(s, units, where) for name, s in self.states.items()}
        return replace(self, parameters=parameters, states=states)

    def scaled(self, sizes: Mapping[str, float]) -> "Effect":
        """The effect with its scaled values converted to numbers for signals of these sizes.

        Raises:
            ModelError: a scale names a size that is not given.
        """
        found = {name: _scaled(name, p, sizes) for name, p in self.parameters.items()}
        return replace(self, parameters=found)


Numbers = TypeVar("Numbers", EffectParameter, EffectState)


def _filled(item: Numbers, units: Mapping[str, str], where: str) -> Numbers:
    if "{" not in item.unit:
        return item
    try:
        unit, shown = resolved(item.unit, units), resolved(item.shown, units)
        if isinstance(item, EffectParameter) and (item.role == "strength" or item.scale):
            unit, shown = _as_difference(unit), _as_difference(shown)
        return replace(item, unit=unit, shown=shown)
    except KeyError as missing:
        raise ModelError(
            f"{where}: found {missing} in its units, which this port does not have"
        ) from None
    except UnitError as error:
        raise ModelError(f"{where}: {error}") from None


def _as_difference(unit: str) -> str:
    """The unit of differences: an offset of 0.5 degC is one of 0.5 K, not of 273.65 K."""
    known = unit_of(unit) if unit else None
    return known.si if known is not None and known.offset else unit


def resolved(unit: str, units: Mapping[str, str]) -> str:
    """A unit of an effect with references in braces replaced by the port's units."""
    return simplified(unit.format_map({name: _bracketed(own) for name, own in units.items()}))


def _bracketed(unit: str) -> str:
    return f"({unit})" if any(sign in unit for sign in " */^") else unit


def _scaled(name: str, p: EffectParameter, sizes: Mapping[str, float]) -> EffectParameter:
    if not p.scale:
        return p
    numbers = {key: sympy.Float(size) for key, size in sizes.items()}
    size = float(parse_expression(p.scale, numbers, f"scale of {name}"))
    tried = tuple(value * size for value in p.tried)
    return replace(
        p, value=p.value * size, low=p.low * size, high=p.high * size, tried=tried, scale=""
    )
