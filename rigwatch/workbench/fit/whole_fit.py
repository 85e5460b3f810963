"""A rough model along the measured motion, fitted to whole recordings.

What runs along the motion forgets its beginning, so that a whole recording is one run, and a value
at which it blows up costs so much that the search steps back. A parameter without bounds has no
size that a search could move it by: it gets one from what it does to the output, so that a
coefficient of any unit moves as easily as another, and a direction in which the recording says
nothing is held by a prior and freezes no other.

A fit that has not converged goes on from where it is.
"""

from collections.abc import Mapping

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import Model, compose
from rigwatch.physics.engine.fit import Fit, Recording, bounds, evaluate
from rigwatch.physics.engine.search import Convergence, WholeRuns, multi_start_fit
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import Data, quiet_scale
from rigwatch.workbench.fit.fitted_model import Fitted
from rigwatch.workbench.study import Study

SHARE = 0.3
"""What a unit of a parameter without bounds does to the output, over the output's own size."""
CARRIED_ON = 4
"""Times at most that a search goes on from where it has ended."""


def fit_whole(
    study: Study, model: Model, data: Data, start: Mapping[str, float], searches: int = 0
) -> Fitted:
    """A model along the measured motion, fitted to the training recording in one run.

    Args:
        study: how finely is integrated.
        model: along the motion; what is free in it is fitted.
        data: recordings along the motion.
        start: values by name, the model's own where there are none.
        searches: drawn starts beside that.

    Raises:
        ModelError: the simulation diverges from every start (NaN or infinite).
    """
    compiled = compile_system(compose(model))
    own = {name: value for name, value in start.items() if name in model.parameters}
    fit, ended = _carried_on(study, compiled, data.train, compiled.vector(own), searches)
    judged = evaluate(fit, data.held_out, len(data.held_out), study.file.substeps)
    return Fitted((), fit, judged, study.file.substeps, len(data.train), None, ended)


def _carried_on(
    study: Study, compiled: CompiledSystem, recording: Recording, start: FloatArray, searches: int
) -> tuple[Fit, Convergence]:
    """The fit from one start, and how it ended."""
    initial: FloatArray | None = None
    scale, substeps = quiet_scale(recording), study.file.substeps
    for _ in range(1 + CARRIED_ON):
        search = WholeRuns(
            compiled, [recording], scale, start=start,
            sizes=sizes_shown(compiled, recording, start, substeps), initial=initial,
            robust=np.inf, substeps=substeps, starts=searches,
        )  # fmt: skip
        fit, ended = multi_start_fit(search)
        if ended.converged:
            break
        start, initial, searches = fit.parameters, fit.initial, 0
    return fit, ended


def sizes_shown(
    compiled: CompiledSystem, recording: Recording, at: FloatArray, substeps: int
) -> FloatArray:
    """How far a search moves parameters without bounds, shape (m,); NaN for the others.

    Each moves the output by `SHARE` of its own size.

    Args:
        compiled: along the motion.
        recording: along the motion.
        at: all parameters, shape (n_p,).
        substeps: Runge-Kutta steps between samples.
    """
    run = compiled.simulate(
        recording.inputs, recording.dt, np.zeros(1, np.int64), len(recording),
        initial=np.zeros((1, len(compiled.system.states))), parameters=at, substeps=substeps,
    )  # fmt: skip
    low, high = bounds(compiled.system)
    slopes = run.slopes[0, :, :, : len(low)] / np.nanstd(recording.outputs, axis=0)[:, None]
    shown = np.sqrt(np.mean(slopes**2, axis=(0, 1)))
    told = ~np.isfinite(high - low) & np.isfinite(shown) & (shown > 0)
    return np.where(told, SHARE / np.where(told, shown, 1.0), np.nan)
