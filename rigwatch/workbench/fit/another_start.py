"""A fit begun once more from another start, as the first may have ended in a local minimum.

Parameters of a model that lacks an effect stand in for it, and those that it hardly determines run
off: a pump's curve and its pipe's friction grow together while the tank's overflow is missing. With
the effect in the model a fit that goes on from there may stop in another minimum, and what that
leaves looks like a further effect. Two models are compared only where each is at its best.
"""

from collections.abc import Mapping

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
    """The better of a fit and one from the given values of the model's parameters.

    Its effects begin where they were found.

    Args:
        study, data, found: the study, its recordings, and a fit of its model with effects.
    """
    start = found.train.values() | given_values(study)
    return _better(study, data, found, start, "the given values")


def begun_over_short_horizons(
    study: Study, data: Data, found: Fitted, begin: Mapping[str, float]
) -> Fitted:
    """The better of a fit and one from the given values that begins over short horizons.

    Args:
        study, data, found: as in `begun_from_given`.
        begin: initial values of the effect in question.
    """
    start = found.train.values() | given_values(study) | dict(begin)
    return _better(study, data, found, start, "short horizons", from_short_horizons=True)


def given_values(study: Study) -> dict[str, float]:
    """The model's parameters as the study or the model's file give them."""
    given = study.file.start
    return {name: given.get(name, p.value) for name, p in study.model.parameters.items()}


def begun_from_larger(study: Study, data: Data, found: Fitted, larger: Fitted) -> Fitted:
    """The better of a fit and one that begins where a fit with a further effect ended.

    If the model needs only the parameters found beside that effect, the effect explains nothing.

    Args:
        study, data, found: as in `begun_from_given`.
        larger: a fit of the same model with the further effect.
    """
    values = larger.train.values()
    start = {name: values[name] for name in found.train.values()}
    return _better(study, data, found, start, "a fit with a further effect")


def _better(
    study: Study,
    data: Data,
    found: Fitted,
    start: Mapping[str, float],
    begun: str,
    *,
    from_short_horizons: bool = False,
) -> Fitted:
    """A fit from another start if it leaves materially less of the training and no more held out.

    Along the motion fits have many starts already, and those of a rough model follow its reference.
    """
    if data.along_motion or study.model.rough:
        return found
    try:
        again = fit_model(
            study, data, found.placements, start, found.train.scale,
            from_short_horizons=from_short_horizons,
        )  # fmt: skip
    except ModelError:
        return found
    lower = again.train_error <= LOWER * found.train_error
    if not lower or again.held_out_error > found.held_out_error:
        return found
    return with_convergence(again, data, begun)
