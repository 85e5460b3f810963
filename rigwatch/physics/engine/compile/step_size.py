"""Step size for stiff effects: effect states, or friction near standstill.

The fourth-order Runge-Kutta method is stable for |∂(dz/dt)/∂z|·h up to 2.78. A contact that slips
after ten micrometres has a rate of 1e5 1/m times its speed, far above the rig's own rates; dry
friction is as steep, but only near standstill. Each interval between two samples is therefore
divided into as many steps as it needs:

    steps per second = max(|∂(dz/dt)/∂z| / 1.0 of effect states,
                           |∂(effect's share of dx/dt)/∂x| / 0.1 of states that cross zero)

The memory of a contact, which is a share of where it slips, asks for them only while it moves: once
it slips its rate is zero, however fast it would return. So that it stays there in any step, the
integration leaves no memory faster than a step allows (`bounded_memory`, `integrator.DAMPED`).
Dry friction that holds a contact at rest is a mode that decays, and asks for a tenth
(`integrator.AT_REST`).

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
CONSTANT = 2.0
"""The same for one whose rate depends on parameters alone, such as a delay's: it only decays, and
what it passes on is exact on average, see `DECAY_ERROR`."""
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
SLIPPING = 0.02
"""Distance of a memory from where it slips below which the steps need not follow its return."""


@dataclass(frozen=True)
class Pace:
    """Rates that determine the step size.

    Attributes:
        crossing: indices of model states near whose zero effects are steep.
        asked: expressions whose magnitudes are the required steps per second [1/s].
        bounded: number of the last of these that ask for a `bounded_memory`.
    """

    crossing: tuple[int, ...] = ()
    asked: tuple[sympy.Expr, ...] = ()
    bounded: int = 0


def pace(system: System) -> Pace:
    """Rates that determine the step size; none without stiff effects."""
    if not system.states or (system.model.states and not system.placements):
        return Pace()
    steep = _steep(system)
    asked = [slope / ACCURATE for slope in steep.values()]
    allowed = STABLE if system.model.states else PASSIVE
    memory = bounded_memory(system)
    others = [n for n in system.states if n not in {*system.model.states, *memory}]
    asked += [
        slope / (CONSTANT if _is_constant(system, slope) else allowed)
        for slope in (*_returns(system, others), *_unlimited(system, others))
    ]
    bounded = [
        sympy.Min(abs(slope), abs(system.derivatives[name]) / SLIPPING, evaluate=False) / allowed
        for name in memory
        for slope in _returns(system, [name])
    ]
    order = list(system.states)
    crossing = tuple(order.index(name) for name in steep)
    return Pace(crossing, (*asked, *bounded), len(bounded))


def bounded_memory(system: System) -> tuple[str, ...]:
    """Effect states without a unit between two bounds, such as the bending of a contact."""
    return tuple(
        name
        for name, state in system.states.items()
        if name not in system.model.states
        and state.unit == "1"
        and math.isfinite(state.low)
        and math.isfinite(state.high)
        and symbol(name) in system.derivatives[name].free_symbols
    )


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


def steps_for(fastest: float, spacing: float) -> int:
    """Steps between samples that the model's constant rates need.

    Args:
        fastest: of these rates, see `fastest_of` [1/s].
        spacing: time between samples [s].
    """
    decay = fastest * spacing
    steps = max(math.ceil(min(decay / DECAYING, FINEST)), 1)
    while steps < FINEST and _decay_error(decay, steps) > DECAY_ERROR:
        steps += 1
    return steps


def fastest_of(system: System, rates: tuple[sympy.Expr, ...], parameters: FloatArray) -> float:
    """The largest of the model's constant rates; 0 without any [1/s].

    Args:
        system: the equations.
        rates: its `constant_rates`.
        parameters: all of them, shape (n_p,).
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


def _returns(system: System, memory: Sequence[str]) -> Sequence[sympy.Expr]:
    """Derivative of each of these effect states' rate by that state, at saturation."""
    slopes = [derivative(system.derivatives[name], symbol(name)) for name in memory]
    every = [name for name in system.states if name not in system.model.states]
    sides = [{symbol(name): side for name in every} for side in (FILLED, -FILLED)]
    return list(dict.fromkeys(s.xreplace(full) for s in slopes for full in sides if s != 0))


def _unlimited(system: System, names: Sequence[str]) -> Sequence[sympy.Expr]:
    """The same with the rate's limits lifted, where it has any.

    A state that is limited at both ends of an interval may arrive within it.
    """
    slopes = [derivative(system.derivatives[name], symbol(name)) for name in names]
    limited = [s for s in slopes if s.has(sympy.Heaviside)]
    lifted = (s.replace(sympy.Heaviside, lambda *_: sympy.Integer(1)) for s in limited)
    return list(dict.fromkeys(slope for slope in lifted if slope != 0))


def _is_constant(system: System, slope: sympy.Expr) -> bool:
    """Whether it depends on parameters alone."""
    return bool(slope.free_symbols <= {symbol(name) for name in system.parameters})
