"""The structure file: nodes with mass that move along one axis, with springs, dampers and loads.

    [nodes.6]
    mass = 1.0

    [springs.k1_6]
    between = ["6"]                  # one node: to ground; two: between them
    stiffness = { value = 1000.0, unknown = true, guess = 1300.0 }
    cubic = 100.0

    [loads.push]
    node = "5"
    step = 1000.0

With d the elongation [m] (position of the first node less that of the second), a spring pulls with

    linear     F = k·d            hardening  F = k·s·sinh(d/s)
    gap        F = k·(d ∓ s) beyond ±s, else 0      softening  F = k·s·tanh(d/s)

plus q·d² + c·d³; k stiffness [N/m], s length [m], q quadratic [N/m^2], c cubic [N/m^3]. A damper
resists with the same in the rate of d: damping [N s/m], quadratic drag q·|ḋ|·ḋ, cubic c·ḋ³.
"""

from typing import Annotated, Literal

from msgspec import Meta, field

from rigwatch.wire.typed_files import Section

Text = Annotated[str, Meta(min_length=1)]
INFINITE = float("inf")


class Coefficient(Section, frozen=True, kw_only=True):
    """A number, known or to be identified."""

    value: Annotated[float, Meta(description="its value if known")]
    unknown: Annotated[bool, Meta(description="whether it is to be identified")] = False
    guess: Annotated[float | None, Meta(description="initial guess; the value if left out")] = None
    low: Annotated[float, Meta(description="lower bound")] = -INFINITE
    high: Annotated[float, Meta(description="upper bound")] = INFINITE

    @property
    def start(self) -> float:
        """The initial guess of an identification."""
        return self.value if self.guess is None else self.guess

    @property
    def present(self) -> bool:
        """Whether it needs a term in the equations."""
        return self.unknown or self.value != 0.0


Number = float | Coefficient
Ends = Annotated[tuple[str, ...], Meta(min_length=1, max_length=2)]


def coefficient(number: Number) -> Coefficient:
    """A plain number is a known coefficient."""
    return number if isinstance(number, Coefficient) else Coefficient(value=number)


class Node(Section, frozen=True, kw_only=True):
    """A point mass that moves along the structure's axis."""

    mass: Annotated[Number, Meta(description="[kg]")]
    x: Annotated[Number, Meta(description="initial position [m]")] = 0.0
    v: Annotated[Number, Meta(description="initial velocity [m/s]")] = 0.0


class Spring(Section, frozen=True, kw_only=True):
    """A spring between two nodes, or from one to ground."""

    between: Annotated[Ends, Meta(description="its ends; one node means to ground")]
    stiffness: Annotated[Number, Meta(description="[N/m]")]
    quadratic: Annotated[Number, Meta(description="[N/m^2]")] = 0.0
    cubic: Annotated[Number, Meta(description="[N/m^3]")] = 0.0
    law: Annotated[
        Literal["linear", "hardening", "softening", "gap"], Meta(description="of the stiffness")
    ] = "linear"
    length: Annotated[Number, Meta(description="length s of the law [m]")] = 0.0


class Damper(Section, frozen=True, kw_only=True):
    """A damper between two nodes, or from one to ground."""

    between: Annotated[Ends, Meta(description="its ends; one node means to ground")]
    damping: Annotated[Number, Meta(description="[N s/m]")] = 0.0
    quadratic: Annotated[Number, Meta(description="drag [N s^2/m^2]")] = 0.0
    cubic: Annotated[Number, Meta(description="[N s^3/m^3]")] = 0.0


class Sine(Section, frozen=True, kw_only=True):
    """One sine of a load."""

    amplitude: Annotated[float, Meta(description="[N], or [m/s^2] at the base")]
    omega: Annotated[float, Meta(description="[rad/s]")]
    phase: Annotated[float, Meta(description="[rad]")] = 0.0


class Load(Section, frozen=True, kw_only=True):
    """A force on a node, or with `base` an acceleration of the ground: the sum of its parts."""

    node: Annotated[str, Meta(description="node that it acts on")] = ""
    base: Annotated[bool, Meta(description="whether it moves the ground instead")] = False
    step: Annotated[float, Meta(description="[N], or [m/s^2] at the base")] = 0.0
    start: Annotated[float, Meta(description="time of the step [s]")] = 0.0
    sines: Annotated[tuple[Sine, ...], Meta(description="sum of sines")] = ()
    channel: Annotated[str, Meta(description="column of the record that holds it")] = ""


class Structure(Section, frozen=True, kw_only=True):
    """The whole file."""

    name: Text
    summary: Annotated[Text, Meta(description="description, a sentence")]
    source: Annotated[str, Meta(description="where it is from")] = ""
    nodes: Annotated[dict[str, Node], Meta(min_length=1)]
    springs: dict[str, Spring]
    dampers: dict[str, Damper] = field(default_factory=dict)
    loads: dict[str, Load] = field(default_factory=dict)
    observed: Annotated[
        tuple[str, ...],
        Meta(description="signals such as x6, v6 or a6; every position if left out"),
    ] = ()

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the observed signals."""
        return self.observed or tuple(label("x", node) for node in self.nodes)


def label(kind: str, node: str) -> str:
    """Name of a node's quantity: x6, or x_roof if the node's name is not a number."""
    return f"{kind}{node}" if node[:1].isdigit() else f"{kind}_{node}"


SPRING_PARTS = {"stiffness": "", "quadratic": "_quadratic", "cubic": "_cubic", "length": "_length"}
DAMPER_PARTS = {"damping": "", "quadratic": "_quadratic", "cubic": "_cubic"}


def coefficients(structure: Structure) -> dict[str, Coefficient]:
    """Every coefficient of the structure by its name in the equations, absent ones included.

    A node's mass is m6; a spring's stiffness has the spring's own name, k1_6, and its other parts
    k1_6_cubic and so on; a node's start is x6(0) and v6(0).
    """
    found: dict[str, Number] = {}
    for name, node in structure.nodes.items():
        found[label("m", name)] = node.mass
    for name, spring in structure.springs.items():
        found |= {name + end: getattr(spring, part) for part, end in SPRING_PARTS.items()}
    for name, damper in structure.dampers.items():
        found |= {name + end: getattr(damper, part) for part, end in DAMPER_PARTS.items()}
    for name, node in structure.nodes.items():
        found |= {f"{label('x', name)}(0)": node.x, f"{label('v', name)}(0)": node.v}
    return {name: coefficient(number) for name, number in found.items()}
