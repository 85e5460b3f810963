"""A model as a file of equations, with ports where effects may enter.

    [states.v]
    unit = "m/s"
    derivative = "(force - k*x - c*v + load)/m"

    [ports.load]
    kind = "force"
    unit = "N"
    variables.x = { expression = "x", unit = "m" }
    variables.v = { expression = "v", unit = "m/s" }

Numbers are given in the unit next to them (mm, bar, kN/mm) and converted to SI when read; equations
compute in SI. `[quantities]` names expressions shared by equations. Equations refer to ports by
name. A force port is a sum of effects, 0 without effects; an actuator port is its input, or a
quantity, as applied to the plant, and a sensor port is an output as read.
"""

import math
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, field
from msgspec.structs import force_setattr

from rigwatch.physics.engine.equations.in_si import into_si
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.typed_files import Section, load, parse
from rigwatch.wire.units import unit_of

Text = Annotated[str, Meta(min_length=1)]


Hold = Literal["linear", "zero"]

PRESENT = "present_"
"""Name of an input that is 1 in recordings with effects, and 0 in those without."""


class Input(Section, frozen=True, kw_only=True):
    """A signal that drives the model."""

    unit: Annotated[str, Meta(description="its unit")]
    channel: Annotated[str, Meta(description="channel of the input, its own name if empty")] = ""
    hold: Annotated[
        Hold | None, Meta(description="hold between samples, that of the model if not given")
    ] = None
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""
    late: Annotated[
        float, Meta(ge=0, le=1, description="delay of a held input, as a share of a sample")
    ] = 0.0
    constant: Annotated[
        bool, Meta(description="constant within a recording, as a load: excites nothing")
    ] = False

    def __post_init__(self) -> None:
        into_si(self)


class State(Section, frozen=True, kw_only=True):
    """A state and its equation."""

    unit: Annotated[str, Meta(description="its unit")]
    derivative: Annotated[Text, Meta(description="its rate of change")]
    start: Annotated[float, Meta(description="initial value if no channel measures it")] = 0.0
    measured: Annotated[str, Meta(description="channel that shows it")] = ""
    rate_of: Annotated[str, Meta(description="channel whose rate of change it is")] = ""
    low: Annotated[float, Meta(description="least initial value of a fit")] = float("-inf")
    high: Annotated[float, Meta(description="largest initial value of a fit")] = float("inf")
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""

    def __post_init__(self) -> None:
        into_si(self, "start", "low", "high")


class Parameter(Section, frozen=True, kw_only=True):
    """A parameter of the model, fitted unless it is fixed."""

    value: Annotated[
        float,
        Meta(description="value, or initial value of a fit; chosen within the bounds if not given"),
    ] = math.nan
    unit: Annotated[str, Meta(description="its unit")]
    low: Annotated[float, Meta(description="lower bound of a fit")] = float("-inf")
    high: Annotated[float, Meta(description="upper bound of a fit")] = float("inf")
    fixed: Annotated[bool, Meta(description="whether it is known")] = False
    kept: Annotated[
        bool, Meta(description="fitted to a healthy recording if there is one, then fixed")
    ] = False
    deviation: Annotated[
        float,
        Meta(ge=0, description="standard deviation of a fixed value"),
    ] = 0.0
    per_recording: Annotated[
        bool,
        Meta(description="fitted for each recording, as a zero that moves between them"),
    ] = False
    meaning: Annotated[str, Meta(description="what it is, in words")] = ""
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""

    @property
    def is_of_opening(self) -> bool:
        """Whether it belongs to one recording and is fitted to its opening, not to what counts."""
        return self.per_recording and self.fixed

    def bounds_broken(self, written: float) -> str:
        """The bound that a value in the unit of the file does not keep, in words; empty if none.

        A value that rounding has moved from a bound keeps it.
        """
        value = float(unit_of(self.shown or self.unit).to_si(written))
        if not math.isfinite(value):
            return "a finite number"
        kept = self.low <= value <= self.high
        if kept or math.isclose(value, self.low) or math.isclose(value, self.high):
            return ""
        bound, most = (self.low, "at least") if value < self.low else (self.high, "at most")
        return f"{most} {self.told(bound)}"

    def told(self, value: float) -> str:
        """A value with the unit it is shown in."""
        name = self.shown or self.unit
        return f"{unit_of(name).from_si(value):g} {'' if name == '1' else name}".rstrip()

    def __post_init__(self) -> None:
        if math.isnan(self.value):
            if self.fixed:
                raise ValueError("a value, as it is fixed")
            force_setattr(self, "value", _within(self.low, self.high))
        unit = unit_of(self.unit)
        width = unit.to_si(self.value + self.deviation) - unit.to_si(self.value)
        into_si(self, "value", "low", "high")
        if not unit.plain:
            force_setattr(self, "deviation", width)


def _within(low: float, high: float) -> float:
    """An initial value: between two bounds, otherwise 1 of its unit or one beyond the bound."""
    if math.isfinite(low) and math.isfinite(high):
        return math.sqrt(low * high) if low > 0 else (low + high) / 2
    if low >= 1:
        return low + max(low, 1.0)
    return high - max(abs(high), 1.0) if high <= 1 else 1.0


class Output(Section, frozen=True, kw_only=True):
    """A signal that the model predicts."""

    unit: Annotated[str, Meta(description="its unit")]
    expression: Annotated[
        Text, Meta(description="what it is, in states, inputs, parameters and quantities")
    ]
    channel: Annotated[str, Meta(description="channel it is compared with, its name if empty")] = ""
    late: Annotated[
        str, Meta(description="parameter: how late its sensor is behind that of the motion")
    ] = ""
    corner: Annotated[
        str, Meta(description="parameter: corner of its sensor's high-pass, in 1/s")
    ] = ""
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""

    def __post_init__(self) -> None:
        into_si(self)


class Quantity(Section, frozen=True, kw_only=True):
    """A named expression, shared by equations or for readability."""

    expression: Annotated[
        Text, Meta(description="what it is, in states, inputs, parameters and quantities")
    ]
    unit: Annotated[str, Meta(description="its unit")]
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""

    def __post_init__(self) -> None:
        into_si(self)


class Variable(Quantity, frozen=True, kw_only=True):
    """A variable that effects at a port may use."""


class Port(Section, frozen=True, kw_only=True):
    """A place where effects may enter."""

    kind: Annotated[
        Literal["force", "actuator", "sensor", "inner"],
        Meta(
            description="how it enters; `inner`: where a signal has passed an element of the"
            " model, entered by effects of the port named before `_beyond_` only"
        ),
    ]
    unit: Annotated[str, Meta(description="unit of what effects add or change here")] = ""
    signal: Annotated[
        str, Meta(description="input or quantity of an actuator port, output of a sensor port")
    ] = ""
    passive: Annotated[
        bool, Meta(description="only effects driven by its variables enter, as through a leak")
    ] = False
    described: Annotated[
        tuple[str, ...],
        Meta(description="families of effects already in the equations here: no candidates"),
    ] = ()
    variables: Annotated[
        dict[str, Variable], Meta(description="variables of effects here, such as x and v")
    ] = field(default_factory=dict)
    shown: Annotated[str, Meta(description="unit to show it in, `unit` if empty")] = ""

    def __post_init__(self) -> None:
        into_si(self)


class Variant(Section, frozen=True, kw_only=True):
    """An alternative law for a part of the model, see `variants.py`."""

    physics: Annotated[Text, Meta(description="its physics, in a sentence")]
    source: Annotated[str, Meta(description="where it comes from")] = ""
    group: Annotated[str, Meta(description="at most one variant of a group is taken")] = ""
    parameters: dict[str, Parameter] = field(default_factory=dict)
    quantities: dict[str, Quantity] = field(default_factory=dict)
    states: dict[str, State] = field(default_factory=dict)
    outputs: dict[str, Output] = field(default_factory=dict)
    without: Annotated[
        tuple[str, ...], Meta(description="states, quantities and parameters that are removed")
    ] = ()


class Model(Section, frozen=True, kw_only=True):
    """The model file."""

    name: Text
    summary: Annotated[Text, Meta(description="what it describes, in a sentence")]
    source: Annotated[str, Meta(description="where its equations come from")] = ""
    hold: Annotated[
        Hold | None,
        Meta(description="hold of inputs between samples; chosen from the data if not given"),
    ] = None
    rough: Annotated[
        bool, Meta(description="has a large residual even on a healthy rig; see the workbench")
    ] = False
    inputs: Annotated[
        dict[str, Input], Meta(description="signals that drive it; none if it moves by itself")
    ] = field(default_factory=dict)
    states: dict[str, State] = field(default_factory=dict)
    parameters: dict[str, Parameter]
    quantities: Annotated[
        dict[str, Quantity], Meta(description="named expressions, for equations and ports")
    ] = field(default_factory=dict)
    outputs: Annotated[dict[str, Output], Meta(min_length=1)]
    ports: dict[str, Port] = field(default_factory=dict)
    variants: Annotated[
        dict[str, Variant], Meta(description="alternative laws for parts of it, for `study base`")
    ] = field(default_factory=dict)

    def held(self, name: str) -> Hold:
        """The hold of an input between samples; linear by default."""
        return self.inputs[name].hold or self.hold or "linear"

    @property
    def presence(self) -> int | None:
        """Place of the input `PRESENT`; None if effects are present in all recordings."""
        return [*self.inputs].index(PRESENT) if PRESENT in self.inputs else None

    def driving(self) -> tuple[str, ...]:
        """Inputs that change within a recording."""
        return tuple(name for name, own in self.inputs.items() if not own.constant)

    def unheld(self) -> tuple[str, ...]:
        """Inputs without a hold in the model."""
        return tuple(n for n, own in self.inputs.items() if not (own.hold or self.hold))


def load_model(path: Path | str) -> Model:
    """The model file at `path`, numbers in SI.

    Raises:
        ConfigError: the file is invalid, or a unit is unknown.
    """
    return load(path, Model)


def parse_model(text: str, file: Path | str) -> Model:
    """The model in the text of a file; `file` is named in errors.

    Raises:
        ConfigError: the text is invalid, or a unit is unknown.
    """
    return parse(text, Model, file)


@cache
def shipped_models() -> dict[str, Model]:
    """The base models that ship with rigwatch, by name."""
    return {name: parse(text, Model, name) for name, text in _shipped_texts().items()}


@cache
def _shipped_texts() -> dict[str, str]:
    """The texts of the shipped model files, by model name."""
    folder = resources.files("rigwatch.physics") / "models"
    files = sorted(folder.iterdir(), key=lambda entry: entry.name)
    texts = [(file.name, file.read_text("utf-8")) for file in files if file.name.endswith(".toml")]
    return {parse(text, Model, name).name: text for name, text in texts}


def model_text(name: str) -> str:
    """The text of a shipped model's file, or of the user's own.

    Raises:
        ConfigError: it cannot be read.
        ModelError: there is no model of this name.
    """
    model_named(name)
    return Path(name).read_text("utf-8") if name.endswith(".toml") else _shipped_texts()[name]


def model_named(name: str, folder: Path | None = None) -> Model:
    """A shipped model by name, or the user's own file, in `folder` if one is given.

    Raises:
        ConfigError: the file is invalid.
        ModelError: there is no model of this name.
    """
    if name.endswith(".toml"):
        return load_model((folder or Path()) / name)
    known = shipped_models()
    if name not in known:
        raise ModelError(f"found model {name!r}{nearest(name, known)}")
    return known[name]
