"""How fine the steps must be where an effect's memory is stiff.

The fourth-order Runge-Kutta method bears |∂(dz/dt)/∂z|·h up to 2.78. A contact that slips after ten
micrometres has 1e5 1/m times its speed there, far above the rates of the rig that it sits in.
"""

from collections.abc import Sequence

import numpy as np
import sympy

from rigwatch.physics.engine.compiled import FloatArray
from rigwatch.physics.engine.numeric import numpy_function
from rigwatch.physics.engine.scope import symbol
from rigwatch.physics.engine.system import TIME, System

STABLE = 2.0
"""Rate times step that is allowed, with a margin."""
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
    rates = [sympy.diff(system.derivatives[name], symbol(name)) for name in memory]
    names = (TIME, *system.states, *system.model.inputs, *system.parameters, *system.probes)
    function = numpy_function(names, rates)
    worst = 0.0
    for side in (FILLED, -FILLED):
        known = [
            side if name in memory or states is None else states[:, index]
            for index, name in enumerate(system.states)
        ]
        found = function(0.0, *known, *inputs.T, *parameters, *[0.0] * len(system.probes))
        worst = max([worst, *(float(np.nanmax(np.abs(rate))) for rate in found)])
    return int(min(MOST_SUBSTEPS, max(1, np.ceil(worst * spacing / STABLE))))
