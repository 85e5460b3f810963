"""How fine the steps must be where an effect is stiff: its memory, or friction about standstill.

The fourth-order Runge-Kutta method bears |∂(dz/dt)/∂z|·h up to 2.78. A contact that slips after ten
micrometres has 1e5 1/m times its speed there, far above the rates of the rig that it sits in; dry
friction is as steep, but only about standstill. So each interval between two samples is cut as
finely as it needs:

    steps a second = max(|∂(dz/dt)/∂z| / 1.0 of what effects remember,
                         |∂(effect's share of dx/dt)/∂x| / 0.1 of what passes through zero)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy

from rigwatch.physics.engine.compile.derivatives import derivative
from rigwatch.physics.engine.equations import System, compose, symbol

STABLE = 1.0
"""Rate times step that is allowed, with a margin."""
ACCURATE = 0.1
"""The same where a state passes through zero, as speed does: there accuracy asks for more."""
ALONE = 2.0
"""The same of a memory that signals drive and that drives nothing itself."""
FINEST = 256
"""Steps between two samples at most."""
FILLED = 1
"""Value of a memory at which its rate is looked at, on both sides."""


@dataclass(frozen=True)
class Pace:
    """What a system's steps must follow.

    Attributes:
        crossing: states of the model that effects make steep about zero, by their place.
        asked: expressions whose sizes are the steps a second that are needed [1/s].
    """

    crossing: tuple[int, ...] = ()
    asked: tuple[sympy.Expr, ...] = ()


def pace(system: System) -> Pace:
    """What the steps must follow; nothing where no effect is stiff."""
    if not system.states or (system.model.states and not system.placements):
        return Pace()
    steep = _steep(system)
    asked = [slope / ACCURATE for slope in steep.values()]
    allowed = STABLE if system.model.states else ALONE
    asked += [slope / allowed for slope in _of_memory(system)]
    order = list(system.states)
    return Pace(tuple(order.index(name) for name in steep), tuple(asked))


def _steep(system: System) -> dict[str, sympy.Expr]:
    """How what effects add to the rate of a state changes with the state itself, by name."""
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
    """How the rate of each state of an effect changes with the state itself, where it is full."""
    memory = [name for name in system.states if name not in system.model.states]
    slopes = [derivative(system.derivatives[name], symbol(name)) for name in memory]
    sides = [{symbol(name): side for name in memory} for side in (FILLED, -FILLED)]
    return list(dict.fromkeys(s.xreplace(full) for s in slopes for full in sides if s != 0))
