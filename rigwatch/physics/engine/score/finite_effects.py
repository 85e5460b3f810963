"""What an effect of finite size adds at its port along a trajectory, driven by the signals there.

The score test sees effects to first order in their strength. A lag of half a period or a hysteresis
as wide as the motion is far from its first order; here it acts with the values it has. What it
changes in the signals that drive it is left out, as in the score test.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from rigwatch.physics.engine.compile import numpy_function
from rigwatch.physics.engine.equations import parse, symbol
from rigwatch.physics.engine.score.candidates import Candidate
from rigwatch.physics.engine.score.trajectory import Trajectory, memory, port_signals, presence
from rigwatch.wire.arrays import FloatArray


def finite_effect(
    at: Trajectory, candidate: Candidate
) -> Callable[[Mapping[str, float]], FloatArray]:
    """The force that an effect adds, or by how much it changes its signal.

    Returns:
        A function of the values of all parameters of the effect [SI], which returns an array of
        shape (windows, nodes).
    """
    signals, effect = port_signals(at, candidate.port), candidate.effect
    names = (*signals, *effect.states, *effect.parameters)
    function = _effect_function(effect.expression, names)
    states = memory(at, candidate, signals) if effect.states else None
    force = at.compiled.system.model.ports[candidate.port].kind == "force"
    without = 0.0 if force else signals["u"]

    def added(values: Mapping[str, float]) -> FloatArray:
        known = {**signals, **(states(values) if states else {}), **values}
        found = function(*(known[name] for name in names))
        change = (np.asarray(found, np.float64) - without) * presence(at)
        return np.broadcast_to(change, at.time.shape)

    return added


@cache
def _effect_function(expression: str, names: tuple[str, ...]) -> Callable[..., Any]:
    symbols = {name: symbol(name) for name in names}
    return numpy_function(names, parse(expression, symbols, "effect"))
