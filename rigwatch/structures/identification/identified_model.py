"""The output of an identified model over its record."""

import numpy as np

from rigwatch.structures.identification.identify import Identification
from rigwatch.structures.identification.problem import Problem
from rigwatch.wire.arrays import FloatArray


def modelled(problem: Problem, found: Identification) -> FloatArray:
    """Outputs of the identified model, shape (samples, outputs).

    Not finite if the model diverges.
    """
    unknowns = np.array([found.parameters[name] for name in found.names])
    with np.errstate(all="ignore"):
        return problem.simulate(unknowns, problem.substeps)[0]


def seconds_of(problem: Problem) -> FloatArray:
    """Time of the samples that count [s], shape (samples,)."""
    return np.arange(problem.first, len(problem.recording)) * np.float64(problem.recording.dt)
