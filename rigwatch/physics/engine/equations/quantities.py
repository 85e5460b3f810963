"""Named intermediate quantities of a model: an expression written once and used by name.

    [quantities]
    push = { expression = "A1*(P1 - Pe) - A2*(P2 - Pe)", unit = "N" }
    acceleration = { expression = "(push - c*v + load)/m", unit = "m/s^2" }

They are not states: a quantity is replaced by its expression, and kernels compute common
subexpressions once. One that is the signal of an actuator port, such as the voltage that a
controller computes, keeps its name, by which the port refers to it.
"""

import re
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter

from msgspec.structs import replace

from rigwatch.physics.engine.equations.expression import check_size, names_in, renamed
from rigwatch.physics.engine.equations.model import Hold, Input, Model, Output, Port, Quantity
from rigwatch.physics.engine.equations.syntax_tree import LONGEST
from rigwatch.wire.errors import ModelError

INWARD = ("actuator", "inner")
"""Kinds of ports that an input or a quantity passes on its way into the equations."""


def in_order(model: Model) -> tuple[str, ...]:
    """Names of the quantities in order of dependence.

    Raises:
        ModelError: one uses itself, directly or through others.
    """
    known = model.quantities
    uses = {n: names_in(q.expression, f"quantity {n}") & known.keys() for n, q in known.items()}
    try:
        return tuple(TopologicalSorter(uses).static_order())
    except CycleError as error:
        circle = " uses ".join(reversed(error.args[1]))
        raise ModelError(
            f"quantities: found the circular definition {circle}, expected none"
        ) from None


def spelt_out(model: Model) -> Model:
    """The model with its quantities replaced by their expressions; signals of ports remain.

    Raises:
        ModelError: their definitions are circular, or the expanded text is too long.
    """
    if not model.quantities:
        return model
    texts: dict[str, str] = {}
    for name in in_order(model):
        texts[name] = f"({_spelt(model.quantities[name].expression, texts, f'quantity {name}')})"
    states = {
        n: replace(s, derivative=_spelt(s.derivative, texts, f"state {n}"))
        for n, s in model.states.items()
    }
    outputs = {
        n: replace(o, expression=_spelt(o.expression, texts, f"output {n}"))
        for n, o in model.outputs.items()
    }
    ports = {
        name: replace(
            port,
            variables={
                n: replace(v, expression=_spelt(v.expression, texts, f"port {name}: variable {n}"))
                for n, v in port.variables.items()
            },
        )
        for name, port in model.ports.items()
    }
    signals = {port.signal for port in ports.values() if port.kind in INWARD}
    quantities = {
        n: replace(q, expression=texts[n][1:-1])
        for n, q in model.quantities.items()
        if n in signals
    }
    return replace(model, states=states, outputs=outputs, ports=ports, quantities=quantities)


def signals_at(model: Model, port: Port) -> dict[str, Input | Quantity | Output]:
    """What may be the signal of an actuator or sensor port, by name."""
    return {**model.inputs, **model.quantities} if port.kind in INWARD else {**model.outputs}


def arriving(model: Model, port: Port) -> str:
    """The signal that arrives at an actuator or sensor port, as an expression."""
    own = signals_at(model, port)[port.signal]
    return port.signal if isinstance(own, Input) else own.expression


def names_reached(model: Model, text: str, where: str) -> frozenset[str]:
    """Names in an expression, and in the quantities at the actuator ports that it names."""
    found, reached = names_in(text, where), frozenset[str]()
    while found - reached:
        ports = [model.ports[name] for name in found - reached if name in model.ports]
        reached = found
        texts = [arriving(model, port) for port in ports if port.kind in INWARD]
        found = found.union(*(names_in(each, where) for each in texts))
    return found


def hold_at(model: Model, port: Port) -> Hold:
    """Hold of the signal at a port between samples.

    At an actuator that of its input; a quantity is held if only held inputs enter it.
    """
    driving = _driving(model, port)
    return "zero" if driving and all(model.held(n) == "zero" for n in driving) else "linear"


def delay_at(model: Model, port: Port) -> float:
    """Delay of held signals at a port, as a share of a sample; zero except at an actuator."""
    return max((model.inputs[n].late for n in _driving(model, port)), default=0.0)


def _driving(model: Model, port: Port) -> frozenset[str]:
    """Inputs that alone determine the signal at an actuator; none if a state does, too."""
    if port.kind != "actuator":
        return frozenset()
    if port.signal in model.inputs:
        return frozenset({port.signal})
    alone = spelt_out(model)
    names = names_reached(alone, alone.quantities[port.signal].expression, "signal")
    forces = {n for n, own in model.ports.items() if own.kind == "force"}
    changing = {*model.states, *forces, "t"}
    return frozenset() if names & changing else names & model.inputs.keys()


def _spelt(text: str, texts: Mapping[str, str], where: str) -> str:
    """An expression with names replaced by texts; a single name needs no brackets."""
    if text.strip() in texts:
        return texts[text.strip()][1:-1]
    words = re.findall(r"\b[A-Za-z_]\w*", text)
    length = len(text) + sum(len(texts.get(word, "")) for word in words)
    if length > LONGEST:
        raise ModelError(
            f"{where}: found {length} characters once its quantities are spelt out,"
            f" expected at most {LONGEST}"
        )
    spelt = renamed(text, texts)
    check_size(spelt, where)
    return spelt
