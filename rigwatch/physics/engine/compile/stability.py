"""Step size of a linearisation, whose steps are equal for all samples."""

import numpy as np

from rigwatch.physics.engine.compile.static_kernel import numpy_function
from rigwatch.physics.engine.compile.step_size import pace
from rigwatch.physics.engine.equations import TIME, UNTIL, System
from rigwatch.wire.arrays import FloatArray

MOST_SUBSTEPS = 64
MOST_FOR_MEMORY = 32
"""Most of them for a memory, which no step makes unstable."""
FINER = 2.0
"""Steps relative to the stability limit of effect states: sensitivities use Heun's method, which
must be accurate.
"""
COARSER = 3.0
"""Steps near standstill relative to these: sensitivities only need to resolve that it is steep."""


def even_substeps(
    system: System, inputs: FloatArray, states: FloatArray, parameters: FloatArray, spacing: float
) -> int:
    """Substeps for the stiffest point of a recording.

    Args:
        system: the equations.
        inputs: shape (n, inputs).
        states: shape (n, states).
        parameters: all of them, shape (n_p,).
        spacing: time between the inputs' samples [s].
    """
    wanted = pace(system)
    if not wanted.asked:
        return 1
    known = (TIME, UNTIL, *system.states, *system.model.inputs, *system.parameters, *system.probes)
    names = (*known, *system.delayed)
    # How late they arrive hardly changes how steep the equations are anywhere.
    late = inputs[:, [list(system.model.inputs).index(own.name) for own in system.delayed.values()]]
    function = numpy_function(names, wanted.asked)
    standing = states.copy()
    standing[:, wanted.crossing] = 0.0
    fastest = 0.0
    for at in (states, standing):
        probes = [0.0] * len(system.probes)
        asked = function(0.0, 0.0, *at.T, *inputs.T, *parameters, *probes, *late.T)
        known_at = [(np.abs(rate), ~np.isnan(rate)) for rate in asked]
        sizes = [float(np.max(size, initial=0.0, where=told)) for size, told in known_at]
        steep, bounded = len(wanted.crossing), len(sizes) - wanted.bounded
        steps = [size / COARSER for size in sizes[:steep]]
        steps += [FINER * size for size in sizes[steep:bounded]]
        steps += [min(FINER * size, MOST_FOR_MEMORY / spacing) for size in sizes[bounded:]]
        fastest = max(fastest, *steps)
    return int(min(MOST_SUBSTEPS, max(1, np.ceil(fastest * spacing))))
