"""What an interval must hold that no single recording shows: the healthy recording's part.

Two things make a fit wrong in the same way all along a recording. The parameters that were taken
from the healthy recording (`kept`), and those that are known to some deviation, such as a mass, are
uncertain themselves: with S their covariance, J_θ and J_κ the slopes of the residual by what is
fitted and by what is kept,

    Cov θ ← Cov θ + A·S·Aᵀ,   A = J_θ⁺·J_κ

And a model that is not quite the rig sees a little of every effect even there. What an effect seems
to be on a healthy recording is taken for a standard deviation of its strength. Both are added as
JCGM 100:2008 (GUM), 5.1, adds independent contributions: by their squares.
"""

import dataclasses

import numpy as np

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Placement, compose
from rigwatch.physics.engine.fit import evaluate
from rigwatch.physics.engine.score import Candidate
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted, loosened
from rigwatch.workbench.ranking import score_all
from rigwatch.workbench.study import Kept, Study


def beyond(study: Study, data: Data, bare: Fitted | None, fitted: Fitted) -> dict[str, float]:
    """Variances to be added to those of the parameters, by name; none without kept parameters.

    Args:
        study, data: as they were fitted.
        bare: the model alone, fitted to the healthy recording.
        fitted: the model with some effects.
    """
    healthy = data.of_healthy
    if study.kept is None or bare is None or healthy is None or not fitted.compiled.system.free:
        return {}
    found = _from_kept(study, study.kept, data, fitted)
    for placement in fitted.placements:
        name = placement.prefix + placement.effect.strength
        if name in found:
            found[name] += apparent_strength(healthy, bare, placement, fitted) ** 2
    return found


def _from_kept(study: Study, kept: Kept, data: Data, fitted: Fitted) -> dict[str, float]:
    """What the uncertainty of the kept parameters does to the fitted ones."""
    train = fitted.train
    compiled = compile_system(compose(loosened(study.model, kept.names), fitted.placements))
    loose = dataclasses.replace(
        train, compiled=compiled, parameters=compiled.vector(train.values())
    )
    at = evaluate(loose, data.train, fitted.horizon, fitted.substeps, train.initial)
    jacobian = at.jacobian.reshape(-1, at.jacobian.shape[-1])
    free, own = list(compiled.system.free), fitted.compiled.system.free
    by_own = jacobian[:, [free.index(name) for name in own]]
    by_kept = jacobian[:, [free.index(name) for name in kept.names]]
    turn = np.linalg.lstsq(by_own, by_kept, rcond=None)[0]
    variances = np.diag(turn @ kept.covariance @ turn.T)
    return dict(zip(own, variances.tolist(), strict=True))


def apparent_strength(healthy: Data, bare: Fitted, placement: Placement, fitted: Fitted) -> float:
    """Strength that an effect seems to have on the healthy recording, to first order."""
    effect, values = placement.effect, fitted.train.values()
    shape = {n: values[placement.prefix + n] for n in effect.parameters if n != effect.strength}
    candidate = Candidate(placement.name, effect, placement.port, shape)
    return float(score_all(healthy, bare, [candidate]).strength[0])
