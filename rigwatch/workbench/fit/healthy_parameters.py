"""What a healthy recording tells once and for all: the parameters of a model that are kept.

The seal of a healthy cylinder leaks a little and its piston drags a little. If a fit to every new
recording could move these, it would swallow the very fault that is looked for; so they are fitted
to the healthy recording and fixed from then on. Without such a recording those that are fixed in
the model stay as they are, and the others are fitted to each recording.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from msgspec import structs

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit.fitted_model import fit_model
from rigwatch.workbench.fit.intervals import covariance
from rigwatch.workbench.study import Kept, Study


def commissioned(study: Study, data: Data, scale: FloatArray | None = None) -> Study:
    """The study with a model whose kept parameters come from the healthy recording.

    Args:
        study: as it was opened.
        data: its recordings.
        scale: divisor of each output's residuals, shape (outputs,).

    Raises:
        ModelError: the model cannot be fitted to the healthy recording.
    """
    healthy = data.of_healthy
    kept = [name for name, p in study.model.parameters.items() if p.kept]
    if healthy is None or not kept:
        return study
    loose = replace(study, model=loosened(study.model))
    found = fit_model(loose, healthy, (), study.file.start, scale, from_afar=True)
    places = [found.compiled.system.free.index(name) for name in kept]
    uncertain = covariance(found.train)[0][np.ix_(places, places)]
    return replace(
        study,
        model=_with_values(study.model, found.train.values()),
        kept=Kept(tuple(kept), uncertain, found.convergence),
    )


def loosened(model: Model) -> Model:
    """The model with its kept parameters free, also where they have been fixed since."""
    free = {
        name: structs.replace(p, fixed=p.fixed and not p.kept)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=free)


def _with_values(model: Model, values: Mapping[str, float]) -> Model:
    changed = {
        name: structs.replace(p, value=values[name], fixed=p.fixed or p.kept)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=changed)
