"""Terms that a rough model can learn from a healthy rig: friction, and products of the motion.

A linear black box does not describe nonlinear behaviour of the healthy rig. Two kinds of terms can
be added, each with its own coefficients:

    friction   F ← F - Fh·tanh(v/vh) - ch·v   at every force port with a speed v
    products   r ← r + Σ k_i·φ_i,             φ_i products of the port's variables, of a given order

at the port `remainder` of the model. A state enters a product as 3·s·tanh(state/(3·s)), with s its
rms, so the simulated terms stay bounded for any coefficients. The terms depend only on the motion
and on hidden states that follow it, not on time, the measured output or a period.
"""

import re
from collections.abc import Mapping
from itertools import combinations_with_replacement

from msgspec.structs import replace

from rigwatch.physics.engine.equations import Model, Parameter

PORT = "remainder"
"""Port at which products enter."""
LEARNED = "learned_"
"""Prefix of the names of learned parameters."""
TURNING_SPEED = 0.03
"""Speed below which healthy friction is proportional to speed, over the rms of the speed."""


def with_friction(model: Model, sizes: Mapping[str, Mapping[str, float]]) -> Model:
    """The model with friction at each force port with a speed among its variables.

    Args:
        model: to be extended.
        sizes: rms of each port's variables, in their units.
    """
    for name, port in model.ports.items():
        if port.kind != "force" or port.passive or "v" not in port.variables:
            continue
        v = port.variables["v"]
        own = f"{LEARNED}{name}_"
        parameters = {
            f"{own}dry": Parameter(value=0.0, unit=port.unit, low=0.0, kept=True,
                                   meaning="dry friction of the healthy rig"),
            f"{own}drag": Parameter(value=0.0, unit=f"({port.unit})/({v.unit})", low=0.0, kept=True,
                                    meaning="drag of the healthy rig"),
            f"{own}slow": Parameter(value=TURNING_SPEED * sizes[name]["v"], unit=v.unit, fixed=True,
                                    meaning="speed up to which that friction turns"),
        }  # fmt: skip
        speed = f"({v.expression})"
        model = replace(model, parameters=model.parameters | parameters)
        terms = f"{own}dry*tanh({speed}/{own}slow) + {own}drag*{speed}"
        model = _with_terms_at(model, name, terms, sign="-")
    return model


def with_products(
    model: Model,
    sizes: Mapping[str, Mapping[str, float]],
    order: int,
    without: tuple[str, ...] = (),
) -> Model:
    """The model with products of one order at its port `remainder`; unchanged without that port.

    Args:
        model: to be extended; products already present are not added again.
        sizes: rms of each port's variables, in their units.
        order: of the products.
        without: variables of the port that are left out.
    """
    port = model.ports.get(PORT)
    if port is None:
        return model
    variables = {n: variable for n, variable in port.variables.items() if n not in without}
    parameters = dict(model.parameters)
    shares = {}
    for name, variable in variables.items():
        size = f"{LEARNED}size_{name}"
        parameters.setdefault(
            size, Parameter(value=sizes[PORT][name], unit=variable.unit, fixed=True)
        )
        bounded = variable.expression in model.states
        shares[name] = _share(variable.expression, size, bounded=bounded)
    terms = []
    for names in combinations_with_replacement(variables, order):
        coefficient = LEARNED + "_".join(names)
        if coefficient not in parameters:
            parameters[coefficient] = Parameter(value=0.0, unit=port.unit, kept=True)
            terms.append("*".join([coefficient, *(shares[name] for name in names)]))
    return _with_terms_at(replace(model, parameters=parameters), PORT, " + ".join(terms))


def _share(expression: str, size: str, *, bounded: bool) -> str:
    """A variable over its rms, bounded if it is simulated."""
    ratio = f"({expression})/{size}"
    return f"3*tanh({ratio}/3)" if bounded else f"({ratio})"


def _with_terms_at(model: Model, port: str, terms: str, sign: str = "+") -> Model:
    """The model with terms added at a port, in all its equations."""
    word, added = re.compile(rf"\b{port}\b"), f"({port} {sign} ({terms}))"
    states = {
        name: replace(state, derivative=word.sub(added, state.derivative))
        for name, state in model.states.items()
    }
    outputs = {
        name: replace(output, expression=word.sub(added, output.expression))
        for name, output in model.outputs.items()
    }
    quantities = {
        name: replace(quantity, expression=word.sub(added, quantity.expression))
        for name, quantity in model.quantities.items()
    }
    return replace(model, states=states, outputs=outputs, quantities=quantities)
