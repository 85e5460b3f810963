"""Elements of a base: effects of the library that the healthy machine has.

A healthy valve has hysteresis, a healthy seal leaks, a healthy piston rubs. Such an element is
written among the study's variants as `effect@port`, with initial values in SI if known:

    variants = ["closed_spool", "valve_hysteresis@drive(b=0.05)"]

and becomes part of the model's equations; its parameters are fitted to the healthy recordings and
kept. An effect that is ranked at the same port acts beside it (forces), before it (actuators) or
after it (sensors), so that more of what is there already is named as what it is. At an actuator an
inner port lies on the element's far side, where an effect is tried as well (`Placement.beyond`).
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from msgspec import structs

from rigwatch.physics.engine.equations import (
    LEFT,
    Effect,
    EffectParameter,
    Model,
    Parameter,
    Placement,
    Quantity,
    State,
    beyond_port,
    renamed,
    units_at,
)
from rigwatch.wire.errors import ModelError

_FORM = re.compile(r"(\w+)@(\w+)(?:\((.*)\))?")


@dataclass(frozen=True)
class Element:
    """An effect at a port that the healthy machine has; `values` of its parameters in SI."""

    effect: str
    port: str
    values: Mapping[str, float]

    @property
    def label(self) -> str:
        """Effect and port as "effect@port"."""
        return f"{self.effect}@{self.port}"

    @property
    def prefix(self) -> str:
        """Prefix of the names of its parameters and states in the model."""
        return f"healthy_{self.port}_{self.effect}_"

    def __str__(self) -> str:
        told = " ".join(f"{name}={value:.6g}" for name, value in self.values.items())
        return f"{self.label}({told})" if told else self.label


def elements_of(names: Sequence[str]) -> tuple[Element, ...]:
    """The elements among the names of variants.

    Raises:
        ModelError: one is not of the form `effect@port(name=value …)`.
    """
    return tuple(_read(name) for name in names if "@" in name)


def written_variants(names: Sequence[str]) -> tuple[str, ...]:
    """The variants of the model file among the names, without elements."""
    return tuple(name for name in names if "@" not in name)


def _read(text: str) -> Element:
    form = _FORM.fullmatch(text.strip())
    pairs = [pair.partition("=") for pair in (form[3] or "").split()] if form else []
    try:
        values = {name: float(value) for name, _, value in pairs}
    except ValueError:
        form = None
    if form is None:
        raise ModelError(
            f"variants: found {text!r}, expected a variant of the model or an effect at a port,"
            " such as valve_hysteresis@drive(b=0.05)"
        )
    return Element(form[1], form[2], values)


def with_element(model: Model, placement: Placement) -> Model:
    """The model with an effect at a port as part of its equations.

    Args:
        model: with the port, before effects.
        placement: the effect, scaled for the port; its values start the fit.
    """
    effect, port = placement.effect, model.ports[placement.port]
    prefix = Element(placement.name, placement.port, {}).prefix
    own = {name: prefix + name for name in (*effect.parameters, *effect.states)}
    own |= {name: f"({v.expression})" for name, v in port.variables.items()} | {LEFT: "0"}
    parameters = {prefix + n: _parameter(placement, n, p) for n, p in effect.parameters.items()}
    if port.kind == "sensor":
        output = model.outputs[port.signal]
        own |= {"u": f"({output.expression})"}
        now = structs.replace(output, expression=renamed(effect.expression, own))
        model = structs.replace(model, outputs=model.outputs | {port.signal: now})
    else:
        name, unit = prefix + "here", units_at(model, placement.port)
        own |= {"u": placement.port}
        inner = beyond_port(placement.port, placement.name)
        after = inner if port.kind == "actuator" else f"({placement.port} + {name})"
        model = _passed(model, {placement.port: after})
        text = renamed(effect.expression, own)
        here = Quantity(expression=text, unit=unit["u" if port.kind == "actuator" else "F"])
        model = structs.replace(model, quantities=model.quantities | {name: here})
        if port.kind == "actuator":
            far = structs.replace(port, kind="inner", signal=name)
            model = structs.replace(model, ports=model.ports | {inner: far})
    return structs.replace(
        model,
        parameters=model.parameters | parameters,
        states=model.states | _states(effect, prefix, own),
    )


def _states(effect: Effect, prefix: str, own: Mapping[str, str]) -> dict[str, State]:
    return {
        prefix + name: State(
            unit=s.unit, derivative=renamed(s.derivative, own), start=s.start, low=s.low,
            high=s.high, shown=s.shown,
        )
        for name, s in effect.states.items()
    }  # fmt: skip


def _passed(model: Model, names: Mapping[str, str]) -> Model:
    """The model with names replaced in its equations."""
    return structs.replace(
        model,
        quantities={
            n: structs.replace(q, expression=renamed(q.expression, names))
            for n, q in model.quantities.items()
        },
        states={
            n: structs.replace(s, derivative=renamed(s.derivative, names))
            for n, s in model.states.items()
        },
        outputs={
            n: structs.replace(o, expression=renamed(o.expression, names))
            for n, o in model.outputs.items()
        },
    )


def _parameter(placement: Placement, name: str, p: EffectParameter) -> Parameter:
    return Parameter(
        value=1.0 if p.role == "switch" else p.value,
        unit=p.unit,
        shown=p.shown,
        low=p.low,
        high=p.high,
        fixed=True,
        kept=p.role in ("strength", "shape"),
        meaning=f"{name} of the healthy machine's {placement.name} at {placement.port}",
    )
