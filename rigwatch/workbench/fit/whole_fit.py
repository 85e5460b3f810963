"""A rough model along the measured motion, fitted to whole recordings.

Along the motion a model forgets its initial state, so each recording is one run; values at which
the run diverges get a large cost, so the search steps back. A parameter without bounds has no
natural scale. It gets one from its influence on the output, so coefficients of all units are scaled
alike, and a prior holds directions that the recording does not determine.

A fit that has not converged is continued from its last values.
"""

from collections.abc import Mapping

import numpy as np

from rigwatch.physics.engine.compile import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import Model, compose
from rigwatch.physics.engine.fit import Fit, Recording, bounds, evaluate, with_opening_values
from rigwatch.physics.engine.search import Convergence, WholeRuns, multi_start_fit
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import Data, quiet_scale
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.study import Study

SHARE = 0.3
"""Change of the output, relative to its deviation, by one scale of an unbounded parameter."""
CONTINUATIONS = 4
"""Largest number of times that a search is continued."""


def fit_whole(
    study: Study, model: Model, data: Data, start: Mapping[str, float], searches: int = 0
) -> Fitted:
    """A model along the measured motion, fitted to the training recording in one run.

    Args:
        study: gives the integration steps per sample.
        model: along the motion; its free parameters are fitted.
        data: recordings along the motion.
        start: initial values by name; the model's own for those not given.
        searches: number of random starts in addition.

    Raises:
        ModelError: the simulation diverges from every start (NaN or infinite).
    """
    compiled = compile_system(compose(model))
    own = {name: value for name, value in start.items() if name in model.parameters}
    fit, ended = _fit_until_converged(study, compiled, data.train, compiled.vector(own), searches)
    fit = with_opening_values(fit, model, data.openings, len(data.train), study.file.substeps)
    judged = evaluate(fit, data.held_out, len(data.held_out), study.file.substeps)
    return Fitted((), fit, judged, study.file.substeps, len(data.train), None, ended)


def _fit_until_converged(
    study: Study, compiled: CompiledSystem, recording: Recording, start: FloatArray, searches: int
) -> tuple[Fit, Convergence]:
    """The fit from one start, and its convergence."""
    initial: FloatArray | None = None
    scale, substeps = quiet_scale(recording), study.file.substeps
    for _ in range(1 + CONTINUATIONS):
        search = WholeRuns(
            compiled, [recording], scale, start=start,
            sizes=search_scales(compiled, recording, start, substeps), initial=initial,
            robust=np.inf, substeps=substeps, starts=searches,
        )  # fmt: skip
        fit, ended = multi_start_fit(search)
        if ended.converged:
            break
        start, initial, searches = fit.parameters, fit.initial, 0
    return fit, ended


def search_scales(
    compiled: CompiledSystem, recording: Recording, at: FloatArray, substeps: int
) -> FloatArray:
    """Scales of the parameters without bounds, shape (m,); NaN for the others.

    One scale changes the output by `SHARE` of its deviation.

    Args:
        compiled: along the motion.
        recording: along the motion.
        at: all parameters, shape (n_p,).
        substeps: Runge-Kutta steps between samples.
    """
    run = compiled.simulate(
        recording.inputs, recording.spacing, np.zeros(1, np.int64), len(recording),
        initial=np.zeros((1, len(compiled.system.states))), parameters=at, substeps=substeps,
    )  # fmt: skip
    low, high = bounds(compiled.system)
    slopes = run.slopes[0, :, :, : len(low)] / np.nanstd(recording.outputs, axis=0)[:, None]
    influence = np.sqrt(np.mean(slopes**2, axis=(0, 1)))
    scaled = ~np.isfinite(high - low) & np.isfinite(influence) & (influence > 0)
    return np.where(scaled, SHARE / np.where(scaled, influence, 1.0), np.nan)
