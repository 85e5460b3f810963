"""Fits the model with an effect in it, and judges the fit on the recordings held out."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from rigwatch.physics.engine.compile import cores, side_by_side
from rigwatch.physics.engine.equations import Placement
from rigwatch.physics.engine.search import undetermined
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import Data, NoiseFloor, lowered
from rigwatch.workbench.fit import (
    Fitted,
    begun_from_given,
    begun_over_short_horizons,
    fit_model,
    fit_with_retry,
    given_values,
    may_be_local_minimum,
    only_noise_left,
    refit_from_short_horizons,
)
from rigwatch.workbench.ranking.acceptance import EXPLAINED, judge_fit, leaves_nothing
from rigwatch.workbench.ranking.ranked import SIMILAR, UNFITTABLE, Ranked
from rigwatch.workbench.ranking.series_order import orders_at_port
from rigwatch.workbench.study import Study

Progress = Callable[[str], None]
Fitting = Callable[..., Fitted]


def no_progress(_: str) -> None:
    """Default progress callback: does nothing."""


def refit(
    study: Study, data: Data, base: Fitted, row: Ranked, fitting: Fitting = fit_with_retry
) -> None:
    """Fit the model with the row's effect and judge it on the recordings held out.

    Args:
        study, data, base: the study, its recordings and the fitted model.
        row: the effect; its fit and the decision are stored in it.
        fitting: `fit_model` accepts the first minimum, `fit_with_retry` also searches elsewhere.
    """
    fits, failures = list[Fitted](), list[str]()
    ended, given = values_of_base(study, base) | row.begin(), _given_of_open(study, data, base)
    for placement in orders_at_port(study, base, row):
        placements = (*base.placements, placement)
        for start in (ended, ended | given) if given else (ended,):
            try:
                fits.append(fitting(study, data, placements, start, base.train.scale, base=base))
            except ModelError as error:
                failures.append(str(error))
                continue
            if given.keys().isdisjoint(undetermined(fits[-1].train)):
                break
    if not fits and not data.along_motion:
        # Where the base model ended need not be near the model with the effect.
        start, placed = ended | given_values(study), (*base.placements, row.placement)
        with suppress(ModelError):
            fits.append(fitting(study, data, placed, start, base.train.scale, base=base))
    if not fits:
        row.reason, row.failure = UNFITTABLE, failures[0]
        return
    row.fitted, row.failure = min(fits, key=lambda fitted: fitted.train_error), ""
    judge_fit(base, row)


def values_of_base(study: Study, base: Fitted) -> dict[str, float]:
    """Values from which a fit with effects begins: those that the base model ended with.

    Where parameters are shared with a recording without effects, they begin where that alone has
    them: the base model's have followed what is missing in the other.
    """
    own = {} if study.model.presence is None else study.model.parameters
    return base.train.values() | {name: p.value for name, p in own.items()}


def _given_of_open(study: Study, data: Data, base: Fitted) -> dict[str, float]:
    """Given values of the parameters that a free run of the base model leaves open.

    They may have run off, as a heat capacity to infinity, from where a fit with the effect that is
    missing does not come back: where it leaves them open too, it is begun from these as well.
    """
    if base.convergence is None or data.along_motion:
        return {}
    given, open_ = given_values(study), base.convergence.undetermined
    return {name: given[name] for name in open_ if name in given}


def fit_started(known: Callable[[Study, Sequence[Placement]], Mapping[str, float]]) -> Fitting:
    """`fit_model` with other initial values.

    Args:
        known: the initial values that replace the given ones, for a study and its placements.
    """

    def fitting(study: Study, *args: Any, **more: Any) -> Fitted:
        data, placements, start, scale = args
        begin = {**start, **known(study, placements)}
        return fit_model(study, data, placements, begin, scale, **more)

    return fitting


def fit_from(found: Fitted | None) -> Fitting:
    """`fit_model` that starts from the model's parameters in another fit."""
    own = found.train.values() if found else {}
    return fit_started(lambda study, _: {n: own[n] for n in study.model.parameters if n in own})


def refit_all(
    study: Study,
    data: Data,
    base: Fitted,
    rows: Sequence[Ranked],
    fitting: Fitting = fit_with_retry,
) -> None:
    """`refit` for rows, side by side; the results do not depend on the number of cores."""
    side_by_side(lambda row: refit(study, data, base, row, fitting), rows)


def fit_each(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    base: Fitted,
    floor: NoiseFloor,
    rows: Sequence[Ranked],
    progress: Progress,
) -> list[Ranked]:
    """Fit rows in turn and return those that explain the error.

    Once a row explains the error, only rows similar to it are fitted, and those with fewer
    parameters: two of them together may explain what its shape parameters mimic. As many rows as
    there are cores are fitted ahead; what one of them makes needless is not used.
    """
    enough: list[Ranked] = []
    ahead: dict[str, Ranked] = {}
    for number, row in enumerate(rows, start=1):
        if any(_is_unlike(row, other) for other in enough):
            if row.fitted is None:
                row.reason = f"unlike {enough[0].label}, which explains {EXPLAINED:.0%}; not fitted"
            continue
        if row.fitted is None:
            progress(f"fitting {row.label}, {number} of at most {len(rows)}")
            if row.label not in ahead:
                waiting = _waiting(rows[number - 1 :], enough)
                ahead = {each.label: replace(each) for each in waiting[: cores()]}
                refit_all(study, data, base, list(ahead.values()), fit_model)
            row.take(ahead[row.label])
        if row.accepted and leaves_nothing(row, base, own_floor(study, data, floor, row)):
            enough.append(row)
    return enough


def _waiting(rows: Sequence[Ranked], enough: Sequence[Ranked]) -> list[Ranked]:
    """Rows to be fitted, unless one of those that explain the error makes it needless."""
    unfitted = [row for row in rows if row.fitted is None]
    return [row for row in unfitted if not any(_is_unlike(row, other) for other in enough)]


def own_floor(study: Study, data: Data, floor: NoiseFloor, row: Ranked) -> NoiseFloor:
    """The noise floor, from a fitted row's residual if that is quieter than the base model's.

    A floor from a healthy recording or from repeated periods stays.
    """
    assert row.fitted is not None
    return lowered(floor, study, data, row.fitted.train, row.fitted.held_out)


def _is_unlike(row: Ranked, other: Ranked) -> bool:
    """Whether it explains another part of the error than one that explains it all, no simpler."""
    return row.free >= other.free and other.cosines[row.label] < SIMILAR


def refit_elsewhere(
    study: Study, data: Data, base: Fitted, rows: Sequence[Ranked], progress: Progress
) -> None:
    """Refit the rows that may have ended in a local minimum."""

    def begun(row: Ranked) -> dict[str, float]:
        return base.train.values() | row.begin()

    again = [(row, row.fitted) for row in rows if row.fitted is not None]
    doubtful = [
        (row, found) for row, found in again if may_be_local_minimum(study, data, found, begun(row))
    ]
    for row, _ in doubtful:
        progress(f"fitting {row.label} again, starting from short horizons")
    better = side_by_side(
        lambda pair: refit_from_short_horizons(study, data, pair[1], begun(pair[0])), doubtful
    )
    for (row, _), found in zip(doubtful, better, strict=True):
        row.fitted = found
        judge_fit(base, row)


def refit_from_given(study: Study, data: Data, base: Fitted, row: Ranked) -> None:
    """Begin a fitted row once more from the model's given values; the better fit is kept.

    One that leaves more than the base model, or whose strength is open, ended where it says nothing
    and begins over short horizons as well: the fewer periods of a motion a window holds, the fewer
    local minima there are.
    """
    assert row.fitted is not None
    row.begun_again = True
    _keep_better(base, row, begun_from_given(study, data, row.fitted))
    if row.vague or row.fitted.train_error > base.train_error:
        _keep_better(base, row, begun_over_short_horizons(study, data, row.fitted, row.begin()))


def _keep_better(base: Fitted, row: Ranked, again: Fitted) -> None:
    """Judge a row anew if it was fitted better."""
    if again is not row.fitted:
        row.fitted = again
        judge_fit(base, row)


def leaves_only_noise(study: Study, data: Data, floor: NoiseFloor, row: Ranked) -> bool:
    """Whether a fitted row leaves only noise, by its own floor."""
    assert row.fitted is not None
    return only_noise_left(own_floor(study, data, floor, row), row.fitted)
