"""A fit begun once more from another start, as the first may have ended in a local minimum.

Parameters of a model that lacks an effect stand in for it, and those that it hardly determines run
off: a pump's curve and its pipe's friction grow together while the tank's overflow is missing. With
the effect in the model a fit that goes on from there may stop in another minimum, and what that
leaves looks like a further effect. Two models are compared only where each is at its best.
"""

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, NoiseFloor
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.fitted_model import fit_model, with_convergence
from rigwatch.workbench.study import Study

LOWER = 0.97
"""Largest ratio of training errors at which another start has led to a better minimum."""
MORE = 1.5
"""Ratio of training error to noise floor above which more than noise is left: the floor is that of
the held-out recordings, whose noise may differ."""


def only_noise_left(floor: NoiseFloor, found: Fitted) -> bool:
    """Whether a fit leaves only noise, held out and in training, so that no other is much better.

    Args:
        floor: of the held-out recordings.
        found: the fit.
    """
    return floor.reached(found.held_out) and floor.ratio(found.train) <= MORE


def begun_from_given(study: Study, data: Data, found: Fitted) -> Fitted:
    """The better of a fit and a search from the given values of the model's parameters.

    Its effects begin where they were found.

    Args:
        study, data, found: the study, its recordings, and a fit of its model with effects.
    """
    if not has_other_starts(study, data):
        return found
    own, given = study.model.parameters, study.file.start
    start = found.train.values() | {name: given.get(name, p.value) for name, p in own.items()}
    try:
        again = fit_model(
            study, data, found.placements, start, found.train.scale, multi_start=True
        )  # fmt: skip
    except ModelError:
        return found
    return _better(found, again)


def begun_from_larger(study: Study, data: Data, found: Fitted, larger: Fitted) -> Fitted:
    """The better of a fit and one that begins where a fit with a further effect ended.

    If the model needs only the parameters found beside that effect, the effect explains nothing.

    Args:
        study, data, found: as in `begun_from_given`.
        larger: a fit of the same model with the further effect.
    """
    if not has_other_starts(study, data):
        return found
    start, names = larger.train.values(), found.train.values()
    try:
        again = fit_model(
            study, data, found.placements, {name: start[name] for name in names},
            found.train.scale, base=found,
        )  # fmt: skip
    except ModelError:
        return found
    label = f"{larger.placements[-1].name}@{larger.placements[-1].port}"
    return _better(found, with_convergence(again, data, f"the fit with {label}"))


def has_other_starts(study: Study, data: Data) -> bool:
    """Whether a study's fits may be begun elsewhere; along the motion they are searched for."""
    return not (data.along_motion or study.model.rough)


def _better(found: Fitted, again: Fitted) -> Fitted:
    """The second fit if it leaves materially less of the training and no more held out."""
    lower = again.train_error <= LOWER * found.train_error
    return again if lower and again.held_out_error <= found.held_out_error else found
