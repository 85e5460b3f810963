"""Selects the terms that a rough model learns from a healthy recording, by held-out error.

Every set of terms (`learned_terms.py`) is fitted to one part of the recording, smaller sets first.
A fit starts from the best subset or, if that fails, from the model without terms. The rest of the
recording decides. Of the sets with nearly the smallest error there, the one with the fewest kinds
of terms is selected, so the result does not depend on the order in which sets are tried.

A set is selected only if its fit has converged and the model stays bounded (`boundedness.py`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from msgspec import structs

from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data
from rigwatch.workbench.fit.boundedness import BoundednessTest, Sizes
from rigwatch.workbench.fit.fitted import Fitted
from rigwatch.workbench.fit.learned_terms import with_friction, with_products
from rigwatch.workbench.fit.whole_fit import fit_whole
from rigwatch.workbench.study import Study

FIT_SHARE = 0.6
"""Share of the healthy recording that terms are fitted to; the rest decides which are kept."""
MIN_GAIN = 0.03
"""Relative fall of the held-out error that justifies more terms."""
DRAWN_STARTS = 5
"""Random starts of the model without terms, in addition to its own values."""

Term = Callable[[Model, Sizes], Model]
TERMS: Mapping[str, Term] = {
    "friction": with_friction,
    "products of three": lambda model, sizes: with_products(model, sizes, 3),
    "products of two": lambda model, sizes: with_products(model, sizes, 2),
}
"""Kinds of terms, by name."""


@dataclass(frozen=True, eq=False)
class Learned:
    """A rough model with the terms learned from a healthy recording.

    Attributes:
        model: along the measured motion, its learned parameters free.
        fitted: the model fitted to the healthy recording.
        steps: names of the terms added.
    """

    model: Model
    fitted: Fitted
    steps: tuple[str, ...]


def learn_terms(study: Study, healthy: Recording, horizon: int) -> Learned:
    """The model along the measured motion with the terms that a healthy recording supports.

    Args:
        study: with its model along the measured motion.
        healthy: recording for the model along the measured motion.
        horizon: samples of a window.

    Raises:
        ModelError: not even the model without terms can be simulated.
    """
    bare = _only_kept_free(study.model)
    both = _split(healthy, horizon)
    first = fit_whole(study, bare, both, study.file.start, DRAWN_STARTS)
    test = BoundednessTest(first, healthy)
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
    """Sets of terms, smaller ones first."""
    return [chosen for n in range(1, len(TERMS) + 1) for chosen in combinations(TERMS, n)]


def _with_terms(model: Model, sizes: Sizes, chosen: tuple[str, ...]) -> Model | None:
    """The model with a set of terms; None if one of them does not apply to it."""
    for name in chosen:
        larger = TERMS[name](model, sizes)
        if larger is model:
            return None
        model = larger
    return model


def _best_first(fits: Mapping[tuple[str, ...], Fitted]) -> list[tuple[str, ...]]:
    """Sets with nearly the smallest error, those with fewest terms first; then the others."""
    least = min(fitted.held_out_error for fitted in fits.values())

    def order(chosen: tuple[str, ...]) -> tuple[bool, int, float]:
        error = fits[chosen].held_out_error
        worse = (1 - MIN_GAIN) * error > least
        return worse, 0 if worse else len(chosen), error

    return sorted(fits, key=order)


def _usable(
    study: Study, model: Model, data: Data, begin: Sequence[Fitted], test: BoundednessTest
) -> Fitted | None:
    """The first usable fit of a model, tried from several initial fits; None if there is none.

    A fit is usable if it neither diverges nor fails to converge, and the model stays bounded.
    """
    for start in begin:
        try:
            found = fit_whole(study, model, data, start.train.values())
        except ModelError:
            continue
        if found.convergence is not None and found.convergence.converged and test.passes(found):
            return found
    return None


def _split(healthy: Recording, horizon: int) -> Data:
    """The recording as a training part and a held-out part."""
    windows = len(healthy) // horizon
    cut = max(round(FIT_SHARE * windows), 1) * horizon
    if cut >= len(healthy):
        return Data(healthy, healthy, None, horizon, ())
    first, rest = healthy.stretch(0, cut), healthy.stretch(cut, len(healthy))
    return Data(first, rest, None, horizon, ())


def _only_kept_free(model: Model) -> Model:
    """The model with only its kept parameters free."""
    parameters = {
        name: structs.replace(p, fixed=not p.kept, kept=p.kept)
        for name, p in model.parameters.items()
    }
    return structs.replace(model, parameters=parameters)
