"""How fine the steps must be where an effect is stiff: its memory, or friction about standstill.

The fourth-order Runge-Kutta method bears |∂(dz/dt)/∂z|·h up to 2.78. A contact that slips after ten
micrometres has 1e5 1/m times its speed there, far above the rates of the rig that it sits in.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy

from rigwatch.physics.engine.compiled import FloatArray
from rigwatch.physics.engine.numeric import numpy_function
from rigwatch.physics.engine.scope import symbol
from rigwatch.physics.engine.system import TIME, UNTIL, System, compose

STABLE = 2.0
"""Rate times step that is allowed, with a margin."""
ACCURATE = 0.3
"""The same where a state passes through zero, as speed does: there accuracy asks for more."""
MOST_SUBSTEPS = 64
FILLED = 1.0
"""Value of a memory at which its rate is looked at, on both sides."""


def stable_substeps(  # noqa: PLR0917 -- they belong together
    system: System,
    memory: Sequence[str],
    inputs: FloatArray,
    states: FloatArray | None,
    parameters: FloatArray,
    spacing: float,
) -> int:
    """Substeps that keep the states called `memory` stable along a recording.

    Args:
        system: the equations.
        memory: names of its states that may be stiff.
        inputs: shape (n, inputs).
        states: of the other states, shape (n, all states) with those of the memory ignored; None
            where there are no others.
        parameters: all of them, shape (n_p,).
        spacing: time between the inputs' samples [s].
    """
    if not memory:
        return 1
    worst = max(
        _fastest(system, memory, side, inputs, states, parameters) for side in (FILLED, -FILLED)
    )
    return _substeps(worst * spacing / STABLE)


def accurate_substeps(
    system: System, inputs: FloatArray, states: FloatArray, parameters: FloatArray, spacing: float
) -> int:
    """Substeps that follow what effects make steep where a state of the model passes through zero.

    Args:
        system, inputs, states, parameters, spacing: as those of `stable_substeps`.
    """
    bare = compose(system.model).derivatives
    effects = {name: rate - bare.get(name, 0) for name, rate in system.derivatives.items()}
    added = replace(system, derivatives=effects)
    worst = max(
        (_fastest(added, [n], 0.0, inputs, states, parameters) for n in system.model.states),
        default=0.0,
    )
    return _substeps(worst * spacing / ACCURATE)


def _substeps(needed: float) -> int:
    return int(min(MOST_SUBSTEPS, max(1, np.ceil(needed))))


def _fastest(  # noqa: PLR0917 -- they belong together
    system: System,
    held: Sequence[str],
    at: float,
    inputs: FloatArray,
    states: FloatArray | None,
    parameters: FloatArray,
) -> float:
    """Largest |∂(dz/dt)/∂z| of the states `held` while all of them are at one value [1/s]."""
    rates = [sympy.diff(system.derivatives[name], symbol(name)) for name in held]
    names = (TIME, UNTIL, *system.states, *system.model.inputs, *system.parameters, *system.probes)
    known = [
        at if name in held or states is None else states[:, index]
        for index, name in enumerate(system.states)
    ]
    function = numpy_function(names, rates)
    found = function(0.0, 0.0, *known, *inputs.T, *parameters, *[0.0] * len(system.probes))
    return max(float(np.nanmax(np.abs(rate))) for rate in found)
