"""Step size for stiff effects: effect states, or friction near standstill.

The fourth-order Runge-Kutta method is stable for |∂(dz/dt)/∂z|·h up to 2.78. A contact that slips
after ten micrometres has a rate of 1e5 1/m times its speed, far above the rig's own rates; dry
friction is as steep, but only near standstill. Each interval between two samples is therefore
divided into as many steps as it needs:

    steps per second = max(|∂(dz/dt)/∂z| / 1.0 of effect states,
                           |∂(effect's share of dx/dt)/∂x| / 0.1 of states that cross zero)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy

from rigwatch.physics.engine.compile.derivatives import derivative
from rigwatch.physics.engine.equations import System, compose, symbol

STABLE = 1.0
"""Largest rate times step, with a margin."""
ACCURATE = 0.1
"""The same near zero crossings of a state, such as speed, where accuracy needs smaller steps."""
PASSIVE = 2.0
"""The same for an effect state that is driven by signals and drives nothing itself."""
FINEST = 256
"""Most steps between two samples."""
FILLED = 1
"""Value of an effect state, with both signs, at which its rate is evaluated."""


@dataclass(frozen=True)
class Pace:
    """Rates that determine the step size.

    Attributes:
        crossing: indices of model states near whose zero effects are steep.
        asked: expressions whose magnitudes are the required steps per second [1/s].
    """

    crossing: tuple[int, ...] = ()
    asked: tuple[sympy.Expr, ...] = ()


def pace(system: System) -> Pace:
    """Rates that determine the step size; none without stiff effects."""
    if not system.states or (system.model.states and not system.placements):
        return Pace()
    steep = _steep(system)
    asked = [slope / ACCURATE for slope in steep.values()]
    allowed = STABLE if system.model.states else PASSIVE
    asked += [slope / allowed for slope in _of_memory(system)]
    order = list(system.states)
    return Pace(tuple(order.index(name) for name in steep), tuple(asked))


def _steep(system: System) -> dict[str, sympy.Expr]:
    """Derivative of the effects' contribution to a state's rate by that state, by name."""
    if not system.model.states:
        return {}
    bare = compose(system.model).derivatives
    found = {}
    for name in system.model.states:
        added = system.derivatives[name] - bare[name]
        slope = derivative(added, symbol(name)) if added != 0 else sympy.Integer(0)
        if slope != 0:
            found[name] = slope
    return found


def _of_memory(system: System) -> Sequence[sympy.Expr]:
    """Derivative of each effect state's rate by that state, at saturation."""
    memory = [name for name in system.states if name not in system.model.states]
    slopes = [derivative(system.derivatives[name], symbol(name)) for name in memory]
    sides = [{symbol(name): side for name in memory} for side in (FILLED, -FILLED)]
    return list(dict.fromkeys(s.xreplace(full) for s in slopes for full in sides if s != 0))
