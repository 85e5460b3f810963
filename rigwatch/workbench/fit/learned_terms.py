"""Terms that a rough model learns from a healthy rig: friction that it has, and products of motion.

A linear box leaves what the rig does otherwise. Two kinds of terms are offered, each with a
coefficient of its own:

    friction   F ← F - Fh·tanh(v/vh) - ch·v   at every force port that sees a speed v
    products   r ← r + Σ k_i·φ_i,             φ_i products of the port's variables, of a given order

at the port `remainder` of the model. A state enters a product as 3·s·tanh(state/(3·s)), with s its
size, so that what is simulated stays bounded by what is measured, whatever the coefficients are.
The terms are functions of the motion and of hidden states that follow it: none knows the time, the
measured output or a period.
"""

import re
from collections.abc import Mapping
from itertools import combinations_with_replacement

from msgspec.structs import replace

from rigwatch.physics.engine.equations import Model, Parameter

PORT = "remainder"
"""Force port that products enter."""
LEARNED = "learned_"
"""What the names of learned parameters and states begin with."""
SLOW = 0.03
"""Speed up to which healthy friction turns with the motion, as a share of the size of the speed."""


def with_friction(model: Model, sizes: Mapping[str, Mapping[str, float]]) -> Model:
    """The model with friction at each force port that sees a speed.

    Args:
        model: to be extended.
        sizes: of each port's variables, in their units.
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
            f"{own}slow": Parameter(value=SLOW * sizes[name]["v"], unit=v.unit, fixed=True,
                                    meaning="speed up to which that friction turns"),
        }  # fmt: skip
        speed = f"({v.expression})"
        model = replace(model, parameters=model.parameters | parameters)
        terms = f"{own}dry*tanh({speed}/{own}slow) + {own}drag*{speed}"
        model = _entering(model, name, terms, sign="-")
    return model


def with_products(
    model: Model,
    sizes: Mapping[str, Mapping[str, float]],
    order: int,
    without: tuple[str, ...] = (),
) -> Model:
    """The model with products of one order at its port `remainder`; as it is where it has none.

    Args:
        model: to be extended; products that it has already are not added again.
        sizes: of each port's variables, in their units.
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
    return _entering(replace(model, parameters=parameters), PORT, " + ".join(terms))


def _share(expression: str, size: str, *, bounded: bool) -> str:
    """A variable over its size, bounded where it is simulated."""
    ratio = f"({expression})/{size}"
    return f"3*tanh({ratio}/3)" if bounded else f"({ratio})"


def _entering(model: Model, port: str, terms: str, sign: str = "+") -> Model:
    """The model with terms added to what enters at a port."""
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
