"""Error of a free run: one simulation from the measured initial state, without re-initialisation.

Benchmarks publish this error, but it is a poor criterion for integrating plants: a correct effect
alone may increase it. It is shown for information only.
"""

import numpy as np

from rigwatch.physics.engine.fit import Recording, initial_states
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.fit.fitted import Fitted


def free_run(fitted: Fitted, recording: Recording) -> FloatArray:
    """Root mean square error of each output over the whole recording, shape (outputs,)."""
    compiled = fitted.compiled
    first = initial_states(compiled.system, recording)[0].copy()
    for index, state in enumerate(compiled.system.states.values()):
        if state.rate_of and not state.measured:
            first[index] = 0.0
    run = compiled.simulate(
        recording.inputs, recording.spacing, np.zeros(1, np.int64), len(recording),
        initial=first[None], parameters=fitted.train.parameters, substeps=fitted.substeps,
        begins=recording.begins, time=recording.time,
    )  # fmt: skip
    error = recording.outputs - run.outputs[0]
    return np.asarray(np.sqrt(np.nanmean(error**2, axis=0)))
