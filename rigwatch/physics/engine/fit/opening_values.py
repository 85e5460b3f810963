"""Values of a held-out recording's own parameters, from its opening, which does not count.

A parameter with `per_recording` is fixed for a recording of which no part is fitted. Its value is
fitted to the recording's first part, with all other parameters at their fitted values, so it
depends on no counted sample and is the same freedom for every effect.
"""

from dataclasses import replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.windowed_fit import Fit, fit


def with_opening_values(
    found: Fit, model: Model, openings: Recording | None, horizon: int, substeps: int
) -> Fit:
    """A fit with the own parameters of held-out recordings, fitted to their openings.

    Args:
        found: the fit.
        model: of the study.
        openings: the first parts of held-out recordings; None if no parameter depends on them.
        horizon: samples of a window.
        substeps: Runge-Kutta steps between samples for non-stiff systems.

    Raises:
        ModelError: the simulation diverges.
    """
    own = [n for n, p in model.parameters.items() if p.is_of_opening]
    if openings is None or not own:
        return found
    system = found.compiled.system
    loose = {n: structs.replace(p, fixed=n not in own) for n, p in system.parameters.items()}
    compiled = compile_system(replace(system, parameters=loose))
    at = fit(
        compiled, openings, horizon, start=found.parameters, scale=found.scale, substeps=substeps
    )
    parameters = np.where([n in own for n in system.parameters], at.parameters, found.parameters)
    return replace(found, parameters=parameters)
