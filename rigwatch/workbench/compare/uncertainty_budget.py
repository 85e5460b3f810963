"""Uncertainty contributions beyond the scatter of a recording: healthy recording, model error.

In a free simulation a law that is not quite the machine's, such as the creep of a smoothed dry
friction where the machine sticks, leaves an error that repeats with the excitation and moves the
parameters alike in each repetition. If the variance with repetitions counted once exceeds that over
time by more than chance, by an F test, it replaces it.

They bias a fit equally along a whole recording. First, the parameters kept from the
healthy recording, and those known to a stated deviation (for example a mass), are uncertain. With S
their covariance, and J_θ and J_κ the derivatives of the residual by the fitted and the kept
parameters,

    Cov θ ← Cov θ + A·S·Aᵀ,   A = -J_θ⁺·J_κ

Second, model error mimics a little of every effect. The apparent strength of an effect on a healthy
recording is used as a standard deviation of its strength.

Along the measured motion, where model error exceeds noise, there are four more. The model's
response to an effect is itself in error by a share of it. A residual that repeats with the
excitation is counted once, and not once per period. And a law that is not the machine's gives one
strength for slow and another for fast motion (`regimes.py`); what the base model leaves on the
healthy recording also varies so, but averages out over the regimes. Laws of the base that the
healthy recording leaves open give a strength each (`bases/model_form.py`). The contributions are
independent and add in quadrature (JCGM 100:2008 (GUM), 5.1).
"""

import dataclasses

import numpy as np
from scipy.stats import f as f_distribution

from rigwatch.physics.engine.compile import compile_system
from rigwatch.physics.engine.equations import Placement, compose
from rigwatch.physics.engine.fit import Fit, evaluate
from rigwatch.physics.engine.score import Candidate
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.bases import variances_between_bases
from rigwatch.workbench.compare.regimes import REGIMES, WITHIN, variances_between_regimes
from rigwatch.workbench.data import Data, repeat_along_motion, repeat_of
from rigwatch.workbench.fit import Fitted, block_numbers, covariance, with_kept_free
from rigwatch.workbench.ranking import score_all
from rigwatch.workbench.study import Kept, Study

CERTAIN = 0.99
"""Probability of the F test that an error repeats with the excitation."""
RESPONSE_ERROR = 0.01
"""Relative error of the response to an effect along the measured motion, as a standard deviation.

Dead bands and saturations of drawn rigs, whose equations differ from the model's, are found within
1.3 %, many times their random error.
"""


def added_variances(
    study: Study, data: Data, bare: Fitted | None, fitted: Fitted
) -> dict[str, float]:
    """Variances to add to those of the parameters, by name.

    Args:
        study, data: as fitted.
        bare: the model alone, fitted to the healthy recording.
        fitted: the model with some effects.
    """
    if not fitted.compiled.system.free:
        return {}
    found = _of_motion(data, bare, fitted) if data.along_motion else _of_repeats(data, fitted)
    healthy = data.of_healthy
    if study.kept is None or bare is None or healthy is None:
        return found
    parts = [_variances(study, study.kept, data, fitted)]
    if data.along_motion:
        parts.append(variances_between_bases(study, data, bare, fitted))
    for name, variance in (each for part in parts for each in part.items()):
        found[name] = found.get(name, 0.0) + variance
    for placement in fitted.placements:
        name = placement.prefix + placement.effect.strength
        if name in found:
            found[name] += apparent_strength(healthy, bare, placement, fitted) ** 2
    return found


def _of_repeats(data: Data, fitted: Fitted) -> dict[str, float]:
    """Variances of the fitted parameters due to an error that repeats with the excitation."""
    repeat = 0 if data.train.thinning is not None else repeat_of(data.train)
    if not repeat:
        return {}
    (once, few), (by_time, many) = (covariance(fitted.train, each) for each in (repeat, 0))
    counted_once, variance = np.diag(once), np.diag(by_time)
    beyond = counted_once > f_distribution.ppf(CERTAIN, few, many) * variance
    added = zip(fitted.compiled.system.free, (counted_once - variance).tolist(), strict=True)
    return {name: more for (name, more), counts in zip(added, beyond, strict=True) if counts}


def _of_motion(data: Data, bare: Fitted | None, fitted: Fitted) -> dict[str, float]:
    """Variances of the fitted parameters due to model error along the measured motion."""
    train = fitted.train
    repeat = repeat_along_motion(data)
    counted_once, by_time = (np.diag(covariance(train, each)[0]) for each in (repeat, 0))
    variances = np.maximum(counted_once - by_time, 0.0)
    variances += _between_regimes(data, bare, fitted)
    found = dict(zip(fitted.compiled.system.free, variances.tolist(), strict=True))
    for placement in fitted.placements:
        _add_response_error(found, placement, fitted)
    return found


def _between_regimes(data: Data, bare: Fitted | None, fitted: Fitted) -> FloatArray:
    """Variances of the free parameters between regimes, less what healthy motion shows, (m,)."""
    found = _regimes_of(fitted.train, data)
    healthy = data.of_healthy
    if bare is None or healthy is None:
        return WITHIN * found
    steps = bare.horizon, fitted.substeps, bare.train.initial
    try:
        along = evaluate(fitted.train, healthy.train, *steps)
    except ModelError:
        # The effect makes the healthy motion diverge, so nothing there can be like it.
        return WITHIN * found
    mimicked = _regimes_of(dataclasses.replace(along, error=bare.train.error), healthy)
    shared = np.minimum(found, mimicked)
    return np.asarray(WITHIN * (found - shared) + shared / REGIMES)


def _regimes_of(train: Fit, data: Data) -> FloatArray:
    block = block_numbers(train, repeat_along_motion(data))
    return variances_between_regimes(train, data.train, block)


def _add_response_error(found: dict[str, float], placement: Placement, fitted: Fitted) -> None:
    values = fitted.train.values()
    for name, parameter in placement.effect.parameters.items():
        whole = placement.prefix + name
        if whole in found and parameter.role in ("strength", "shape"):
            found[whole] += (RESPONSE_ERROR * (values[whole] - parameter.neutral)) ** 2


def _variances(study: Study, kept: Kept, data: Data, fitted: Fitted) -> dict[str, float]:
    """Variances of the fitted parameters due to the kept ones."""
    if not kept.names:
        return {}
    turn = _by_kept(study, kept, data, fitted)
    variances = np.diag(turn @ kept.covariance @ turn.T)
    return dict(zip(fitted.compiled.system.free, variances.tolist(), strict=True))


def _by_kept(study: Study, kept: Kept, data: Data, fitted: Fitted) -> FloatArray:
    """Derivatives of the fitted parameters by the kept ones, shape (fitted, kept)."""
    train = fitted.train
    compiled = compile_system(compose(with_kept_free(study.model, kept.names), fitted.placements))
    loose = dataclasses.replace(
        train, compiled=compiled, parameters=compiled.vector(train.values())
    )
    at = evaluate(loose, data.train, fitted.horizon, fitted.substeps, train.initial)
    jacobian = at.jacobian.reshape(-1, at.jacobian.shape[-1])
    free, own = list(compiled.system.free), fitted.compiled.system.free
    by_own = jacobian[:, [free.index(name) for name in own]]
    by_kept = jacobian[:, [free.index(name) for name in kept.names]]
    return np.asarray(-np.linalg.lstsq(by_own, by_kept, rcond=None)[0])


def by_known(study: Study, data: Data, fitted: Fitted) -> dict[str, dict[str, float]]:
    """Derivatives of the fitted parameters by each known one with a stated deviation.

    They include that the kept parameters move with the known one: by Cov(κ, m)/Var(m).

    Args:
        study, data: as fitted.
        fitted: the model with some effects.
    """
    kept = study.kept
    if kept is None or not fitted.compiled.system.free:
        return {}
    turn, found = _by_kept(study, kept, data, fitted), {}
    for index, name in enumerate(kept.names):
        if study.model.parameters[name].deviation:
            moves = kept.covariance[:, index] / kept.covariance[index, index]
            values = zip(fitted.compiled.system.free, (turn @ moves).tolist(), strict=True)
            found[name] = dict(values)
    return found


def apparent_strength(healthy: Data, bare: Fitted, placement: Placement, fitted: Fitted) -> float:
    """Apparent strength of an effect on the healthy recording, to first order."""
    effect, values = placement.effect, fitted.train.values()
    shape = {n: values[placement.prefix + n] for n in effect.parameters if n != effect.strength}
    candidate = Candidate(placement.name, effect, placement.port, shape)
    return float(score_all(healthy, bare, [candidate]).strength[0])
