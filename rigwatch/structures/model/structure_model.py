"""Turns a structure into a model of the physics engine.

States are a position x and a velocity v of each node; every coefficient is a parameter. With B_s
the row of a spring or damper s (+1 at its first node, −1 at its second) and d_s = B_s·x,

    m_i·dv_i/dt = load_i − Σ_s B_si·( F_s(d_s, ḋ_s) − port_s )

Each spring is also a port `at_<spring>` between its nodes, so that an effect there (a softer, a
harder, a broken spring) has the sign convention of the spring.
"""

from collections.abc import Iterator, Mapping
from typing import TypeVar

from rigwatch.physics.engine.equations import (
    Input,
    Model,
    Output,
    Parameter,
    Port,
    State,
    Variable,
)
from rigwatch.structures.model.description import (
    Coefficient,
    Damper,
    Load,
    Spring,
    Structure,
    coefficient,
    coefficients,
    label,
)
from rigwatch.wire.errors import ModelError

T = TypeVar("T", Spring, Damper)

_LAWS = {
    "linear": "{k}*{d}",
    "hardening": "{k}*{s}*(exp({d}/{s}) - exp(-{d}/{s}))/2",
    "softening": "{k}*{s}*tanh({d}/{s})",
    "gap": "{k}*(max({d} - {s}, 0) + min({d} + {s}, 0))",
}
_UNITS = {
    Spring: {"": "N/m", "_quadratic": "N/m^2", "_cubic": "N/m^3", "_length": "m"},
    Damper: {"": "N s/m", "_quadratic": "N s^2/m^2", "_cubic": "N s^3/m^3"},
}
_SIGNAL_UNITS = {"x": "m", "v": "m/s", "a": "m/s^2"}
SMALLEST_MASS = 1e-9


def port_of(spring: str) -> str:
    """Name of the port between the nodes of a spring."""
    return f"at_{spring}"


def to_model(structure: Structure, *, ports: bool = True) -> Model:
    """The structure as equations.

    Args:
        structure: its unknown coefficients become free parameters.
        ports: whether effects may enter at the springs (the kernel is smaller without).

    Raises:
        ModelError: an observed signal is none of x, v, a of a node.
    """
    accelerations = {node: _acceleration(structure, node, ports) for node in structure.nodes}
    return Model(
        name=structure.name,
        summary=structure.summary,
        source=structure.source,
        inputs=_inputs(structure),
        states=_states(structure, accelerations),
        parameters=_parameters(structure),
        outputs={name: _output(structure, name, accelerations) for name in structure.signals},
        ports=_ports(structure) if ports else {},
    )


def elongation(ends: tuple[str, ...], kind: str = "x") -> str:
    """What a spring between `ends` feels: the first node's position less the second's."""
    names = [label(kind, node) for node in ends]
    return names[0] if len(names) == 1 else f"({names[0]} - {names[1]})"


def spring_force(name: str, spring: Spring) -> str:
    """The spring's pull as an expression [N]."""
    d = elongation(spring.between)
    terms = [_LAWS[spring.law].format(k=name, d=d, s=f"{name}_length")]
    if coefficient(spring.quadratic).present:
        terms.append(f"{name}_quadratic*{d}**2")
    if coefficient(spring.cubic).present:
        terms.append(f"{name}_cubic*{d}**3")
    return " + ".join(terms)


def damper_force(name: str, damper: Damper) -> str:
    """The damper's resistance as an expression [N]."""
    rate = elongation(damper.between, "v")
    laws = {"": "{n}*{r}", "_quadratic": "{n}*{r}*abs({r})", "_cubic": "{n}*{r}**3"}
    parts = {"": damper.damping, "_quadratic": damper.quadratic, "_cubic": damper.cubic}
    terms = [
        laws[end].format(n=name + end, r=rate)
        for end, number in parts.items()
        if coefficient(number).present
    ]
    return " + ".join(terms) or "0"


def _acceleration(structure: Structure, node: str, ports: bool) -> str:
    terms = list(_load_terms(structure, node))
    for name, spring, sign in _attached(structure.springs, node):
        pull = f"({spring_force(name, spring)}{f' - {port_of(name)}' if ports else ''})"
        terms.append(f"{sign}{pull}")
    for name, damper, sign in _attached(structure.dampers, node):
        terms.append(f"{sign}({damper_force(name, damper)})")
    base = "".join(f" - ({_signal(n, ld)})" for n, ld in structure.loads.items() if ld.base)
    forces = "".join(terms).removeprefix(" + ") or "0"
    return f"({forces})/{label('m', node)}{base}"


def _attached(items: Mapping[str, T], node: str) -> Iterator[tuple[str, T, str]]:
    """What is attached to the node, with the sign of its pull in the node's equation."""
    for name, item in items.items():
        if node in item.between:
            yield name, item, " - " if item.between[0] == node else " + "


def _load_terms(structure: Structure, node: str) -> Iterator[str]:
    for name, load in structure.loads.items():
        if load.node == node and not load.base:
            yield f" + {_signal(name, load)}" if terms_of(load) else " + 0"


def terms_of(load: Load) -> int:
    """How many terms a load's expression has."""
    return bool(load.step) + len(load.sines) + bool(load.channel)


def _signal(name: str, load: Load) -> str:
    """A load as an expression in time, its constants and its channel."""
    terms = []
    if load.step:
        always = load.start <= 0
        terms.append(f"{name}_step" if always else f"where(t >= {name}_start, {name}_step, 0)")
    terms += [
        f"{name}_amplitude{i}*sin({name}_omega{i}*t + {name}_phase{i})"
        for i, _ in enumerate(load.sines)
    ]
    if load.channel:
        terms.append(load.channel)
    return " + ".join(terms) or "0"


def _inputs(structure: Structure) -> dict[str, Input]:
    return {
        load.channel: Input(unit=_load_unit(load))
        for load in structure.loads.values()
        if load.channel
    }


def _load_unit(load: Load) -> str:
    return "m/s^2" if load.base else "N"


def _states(structure: Structure, accelerations: Mapping[str, str]) -> dict[str, State]:
    states: dict[str, State] = {}
    for name, node in structure.nodes.items():
        x, v = label("x", name), label("v", name)
        states[x] = State(unit="m", derivative=v, start=coefficient(node.x).start, measured=x)
        states[v] = State(
            unit="m/s",
            derivative=accelerations[name],
            start=coefficient(node.v).start,
            measured=v,
            rate_of=x,
        )
    return states


def _output(structure: Structure, name: str, accelerations: Mapping[str, str]) -> Output:
    for node, acceleration in accelerations.items():
        meanings = {"x": label("x", node), "v": label("v", node), "a": acceleration}
        for kind, expression in meanings.items():
            if name == label(kind, node):
                return Output(unit=_SIGNAL_UNITS[kind], expression=expression)
    raise ModelError(
        f"{structure.name}: found the observed signal {name!r}, expected x, v or a of a node,"
        f" such as {label('x', next(iter(structure.nodes)))!r}"
    )


def _parameters(structure: Structure) -> dict[str, Parameter]:
    numbers, units = coefficients(structure), _units(structure)
    found = {
        name: _parameter(numbers[name], unit, mass=unit == "kg")
        for name, unit in units.items()
        if numbers[name].present or unit in {"kg", "N/m"}
    }
    for name, load in structure.loads.items():
        found |= _load_constants(name, load)
    return found


def _units(structure: Structure) -> dict[str, str]:
    """Unit of every coefficient that stands in the equations."""
    units = {label("m", node): "kg" for node in structure.nodes}
    for table, kind in ((structure.springs, Spring), (structure.dampers, Damper)):
        for name in table:
            units |= {name + end: unit for end, unit in _UNITS[kind].items()}
    return units


def _parameter(number: Coefficient, unit: str, *, mass: bool) -> Parameter:
    return Parameter(
        value=number.start if number.unknown else number.value,
        unit=unit,
        low=max(number.low, SMALLEST_MASS) if mass else number.low,
        high=number.high,
        fixed=not number.unknown,
    )


def _load_constants(name: str, load: Load) -> dict[str, Parameter]:
    unit = _load_unit(load)
    values = {f"{name}_step": (load.step, unit), f"{name}_start": (load.start, "s")}
    for i, sine in enumerate(load.sines):
        values |= {
            f"{name}_amplitude{i}": (sine.amplitude, unit),
            f"{name}_omega{i}": (sine.omega, "1/s"),
            f"{name}_phase{i}": (sine.phase, "1"),
        }
    return {key: Parameter(value=v, unit=u, fixed=True) for key, (v, u) in values.items()}


def _ports(structure: Structure) -> dict[str, Port]:
    springs = {
        port_of(name): Port(
            kind="force",
            unit="N",
            variables={
                "x": Variable(expression=elongation(spring.between), unit="m"),
                "v": Variable(expression=elongation(spring.between, "v"), unit="m/s"),
            },
        )
        for name, spring in structure.springs.items()
    }
    sensors = {f"sensor_{name}": Port(kind="sensor", signal=name) for name in structure.signals}
    return springs | sensors
