"""Step size for stiff effects: effect states, or friction near standstill.

The fourth-order Runge-Kutta method is stable for |∂(dz/dt)/∂z|·h up to 2.78. A contact that slips
after ten micrometres has a rate of 1e5 1/m times its speed, far above the rig's own rates; dry
friction is as steep, but only near standstill. Each interval between two samples is therefore
divided into as many steps as it needs:

    steps per second = max(|∂(dz/dt)/∂z| / 1.0 of effect states,
                           |∂(effect's share of dx/dt)/∂x| / 0.1 of states that cross zero)

A model's own constant rates, such as R/L of a winding, ask for the same. Where a step is just
stable a mode that should decay at once does not decay at all, so that its initial state becomes a
free constant of each window, and a fit finds that instead of the parameters.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy

from rigwatch.physics.engine.compile.derivatives import derivative
from rigwatch.physics.engine.compile.static_kernel import numpy_function
from rigwatch.physics.engine.equations import System, compose, symbol
from rigwatch.wire.arrays import FloatArray

STABLE = 1.0
"""Largest rate times step, with a margin."""
ACCURATE = 0.1
"""The same near zero crossings of a state, such as speed, where accuracy needs smaller steps."""
PASSIVE = 2.0
"""The same for an effect state that is driven by signals and drives nothing itself."""
DECAY_ERROR = 3e-4
"""Largest error of the decay of a model's own mode between two samples, relative to its start: too
small to be seen as a jump of a fit's error where the number of steps changes. A Runge-Kutta step
keeps the linear invariants of a mode and what it drives, so its integral is exact in any case."""
DECAYING = 1.25
"""Largest rate times step of a mode that has to decay: states that are coupled as strongly as they
decay have modes of twice the rate, and those decay, too."""
INSTANT = 16.0
"""Rate times the time between samples from which a mode is instantaneous for any recording."""
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


def constant_rates(system: System) -> tuple[sympy.Expr, ...]:
    """|∂(dx/dt)/∂x| of the model's states, where it depends on parameters alone [1/s].

    They are the model's own: an effect that adds to such a slope, as a brush's drop does to that of
    a current, leaves the mode as fast as it is without it.
    """
    if not system.model.states:
        return ()
    known = {symbol(name) for name in system.parameters}
    bare = compose(system.model).derivatives
    slopes = (derivative(bare[name], symbol(name)) for name in system.model.states)
    return tuple(dict.fromkeys(s for s in slopes if s.free_symbols and s.free_symbols <= known))


def steps_for(
    system: System, rates: tuple[sympy.Expr, ...], parameters: FloatArray, spacing: float
) -> int:
    """Steps between samples that the model's constant rates need.

    Args:
        system: the equations.
        rates: its `constant_rates`.
        parameters: all of them, shape (n_p,).
        spacing: time between samples [s].
    """
    fastest = fastest_of(system, rates, parameters) * spacing
    steps = max(math.ceil(min(fastest / DECAYING, FINEST)), 1)
    while steps < FINEST and _decay_error(fastest, steps) > DECAY_ERROR:
        steps += 1
    return steps


def fastest_of(system: System, rates: tuple[sympy.Expr, ...], parameters: FloatArray) -> float:
    """The largest of the model's constant rates; 0 without any [1/s].

    Args:
        system, rates, parameters: as in `steps_for`.
    """
    if not rates:
        return 0.0
    found = np.abs(numpy_function(tuple(system.parameters), rates)(*parameters))
    return float(np.nanmax(found))


def _decay_error(decay: float, steps: int) -> float:
    """Error of e^-decay in a number of Runge-Kutta steps."""
    z = decay / steps
    factor = 1.0 - z + z**2 / 2.0 - z**3 / 6.0 + z**4 / 24.0
    return abs(float(factor**steps) - math.exp(-decay))


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
