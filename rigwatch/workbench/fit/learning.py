"""What a rough model learns from a healthy recording: terms that windows not fitted gain by.

Every set of terms (`learned_terms.py`) is fitted for itself to one part of the recording, the
smaller ones first, and each from the best that it contains or, where that leads nowhere, from the
model without terms; the rest of the recording decides. Of those that leave as little as any the one
with the fewest kinds of terms is taken, so that no order in which terms are tried matters.

A set is taken only if its fit has converged and the model stays where it belongs (`staying.py`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from msgspec import structs

from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit.fitted_model import Fitted
from rigwatch.workbench.fit.learned_terms import with_friction, with_products
from rigwatch.workbench.fit.staying import Sizes, Staying
from rigwatch.workbench.fit.whole_fit import fit_whole
from rigwatch.workbench.study import Study

FIT_SHARE = 0.6
"""Share of the healthy recording that terms are fitted to; the rest decides on them."""
WORTH = 0.03
"""Share by which the error of windows that were not fitted must fall for more terms."""
SEARCHES = 5
"""Drawn starts of the model without terms, beside its own values."""

Term = Callable[[Model, Sizes], Model]
TERMS: Mapping[str, Term] = {
    "friction": with_friction,
    "products of three": lambda model, sizes: with_products(model, sizes, 3),
    "products of two": lambda model, sizes: with_products(model, sizes, 2),
}
"""What may be learned, by what it is called."""


@dataclass(frozen=True, eq=False)
class Learned:
    """What a healthy recording has taught.

    Attributes:
        model: along the measured motion, its learned parameters free.
        fitted: it, fitted to the healthy recording.
        steps: what was added.
    """

    model: Model
    fitted: Fitted
    steps: tuple[str, ...]


def learn(study: Study, healthy: Recording, horizon: int) -> Learned:
    """The model along the measured motion with the terms that a healthy recording is worth.

    Args:
        study: with its model along the measured motion.
        healthy: recording for the model along the measured motion.
        horizon: samples of a window.

    Raises:
        ModelError: not even the model without terms can be simulated.
    """
    bare = _loose(study.model)
    both = _split(healthy, horizon)
    first = fit_whole(study, bare, both, study.file.start, SEARCHES)
    test = Staying(first, healthy)
    models: dict[tuple[str, ...], Model] = {(): bare}
    fits: dict[tuple[str, ...], Fitted] = {(): first}
    for chosen in _sets():
        model = _with_terms(bare, test.sizes, chosen)
        if model is None:
            continue
        parents = [fits[less] for less in fits if set(less) < set(chosen)]
        begin = min(parents, key=lambda fitted: fitted.held_out_error)
        tried = _usable(study, model, both, [begin, first], test)
        if tried is not None:
            models[chosen], fits[chosen] = model, tried
    whole = Data(healthy, healthy, None, horizon, ())
    for chosen in _best_first(fits):
        found = _usable(study, models[chosen], whole, [fits[chosen]], test)
        if found is not None:
            return Learned(models[chosen], found, chosen)
    return Learned(bare, fit_whole(study, bare, whole, first.train.values()), ())


def _sets() -> list[tuple[str, ...]]:
    """Sets of terms, the smaller ones first."""
    return [chosen for n in range(1, len(TERMS) + 1) for chosen in combinations(TERMS, n)]


def _with_terms(model: Model, sizes: Sizes, chosen: tuple[str, ...]) -> Model | None:
    """The model with a set of terms; None where one of them has no place in it."""
    for name in chosen:
        larger = TERMS[name](model, sizes)
        if larger is model:
            return None
        model = larger
    return model


def _best_first(fits: Mapping[tuple[str, ...], Fitted]) -> list[tuple[str, ...]]:
    """Sets that leave as little as any, the smallest of them first; then the others."""
    least = min(fitted.held_out_error for fitted in fits.values())

    def order(chosen: tuple[str, ...]) -> tuple[bool, int, float]:
        error = fits[chosen].held_out_error
        worse = (1 - WORTH) * error > least
        return worse, 0 if worse else len(chosen), error

    return sorted(fits, key=order)


def _usable(
    study: Study, model: Model, data: Data, begin: Sequence[Fitted], test: Staying
) -> Fitted | None:
    """A model's fit from the first of several fits that leads to a usable one; None if none does.

    One that diverges, has not converged, or does not stay where it belongs is not used.
    """
    for start in begin:
        try:
            found = fit_whole(study, model, data, start.train.values())
        except ModelError:
            continue
        if found.convergence is not None and found.convergence.converged and test.stays(found):
            return found
    return None


def _split(healthy: Recording, horizon: int) -> Data:
    """A part of the recording that is fitted, and the rest, which decides."""
    windows = len(healthy) // horizon
    cut = max(round(FIT_SHARE * windows), 1) * horizon
    if cut >= len(healthy):
        return Data(healthy, healthy, None, horizon, ())
    first, rest = (
        Recording(healthy.dt, healthy.inputs[part], healthy.outputs[part])
        for part in (slice(cut), slice(cut, None))
    )
    return Data(first, rest, None, horizon, ())


def _loose(model: Model) -> Model:
    """The model with all that a healthy recording may tell free, but what forces divide by."""
    parameters = {
        name: structs.replace(p, fixed=not p.kept, kept=p.kept)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)
