"""Named intermediate quantities of a model: an expression written once and used by name.

    [quantities]
    push = { expression = "A1*(P1 - Pe) - A2*(P2 - Pe)", unit = "N" }
    acceleration = { expression = "(push - c*v + load)/m", unit = "m/s^2" }

They are not states: a quantity is replaced by its expression, and kernels compute common
subexpressions once.
"""

import re
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter

from msgspec.structs import replace

from rigwatch.physics.engine.equations.expression import check_size, names_in, renamed
from rigwatch.physics.engine.equations.model import Model
from rigwatch.physics.engine.equations.syntax_tree import LONGEST
from rigwatch.wire.errors import ModelError


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
    """The model with its quantities replaced by their expressions.

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
    return replace(model, states=states, outputs=outputs, ports=ports, quantities={})


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
