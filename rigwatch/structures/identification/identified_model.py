"""What an identified model does where the record was taken."""

import numpy as np

from rigwatch.structures.identification.identify import Identification
from rigwatch.structures.identification.problem import Problem
from rigwatch.wire.arrays import FloatArray


def modelled(problem: Problem, found: Identification) -> FloatArray:
    """Outputs of the model with what was found, shape (samples, outputs).

    Not finite where the figures let it run away.
    """
    unknowns = np.array([found.parameters[name] for name in found.names])
    with np.errstate(all="ignore"):
        return problem.simulate(unknowns, problem.substeps)[0]


def seconds_of(problem: Problem) -> FloatArray:
    """Time of the samples that count [s], shape (samples,)."""
    return np.arange(problem.first, len(problem.recording)) * np.float64(problem.recording.dt)
