"""Fits to the training and the healthy recording together, see `beside_healthy.py`."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rigwatch.physics.engine.fit import Fit, with_effects
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.beside_healthy import may_share
from rigwatch.workbench.compare.preparation import Bench, beside_healthy
from rigwatch.workbench.fit import Fitted, fit_model
from rigwatch.workbench.ranking import MATERIAL, STEP, Ranked, difference, refit

AS_BEFORE = 1.05
"""Largest ratio of the healthy recording's error to that of the parameters' own fit to it: the
allowance of the noise floor along a healthy motion."""
NEARLY_AS_BEFORE, LEFT = 1.1, 0.03
"""That ratio where the effect explains the error: it leaves at most this share of its energy beyond
the model's own. A model that is a little wrong fits each motion alone a little better than both."""
REFUSED = "the healthy recording is no longer described with it"


def shared_bench(bench: Bench) -> Bench | None:
    """The bench with the healthy recording in its training; None if it does not suit the study."""
    if not may_share(bench.study, bench.data):
        return None
    try:
        return beside_healthy(bench)
    except ModelError:
        return None


def refuse_what_spoils(both: Bench, rows: Iterable[Ranked]) -> None:
    """Refuse effects beside which the parameters no longer describe the healthy recording.

    What explains the error may leave that a little worse described (`NEARLY_AS_BEFORE`), unless an
    effect that explains it leaves it as before.

    Args:
        both: of `shared_bench`; nothing is spoilt if its training does not hold that recording.
        rows: of its ranking.
    """
    if both.study.model.presence is None:
        return
    fits = [(row, row.fitted) for row in rows if row.accepted and row.fitted is not None]
    ratios = [(row, _healthy_error(both, fitted), _explains(both, fitted)) for row, fitted in fits]
    kept = any(ratio <= AS_BEFORE and explains for _, ratio, explains in ratios)
    for row, ratio, explains in ratios:
        if ratio > (NEARLY_AS_BEFORE if explains and not kept else AS_BEFORE):
            row.accepted, row.reason = False, REFUSED


def spoils_healthy(bench: Bench, fitted: Fitted) -> bool:
    """Whether what is fitted beside the healthy recording no longer describes that.

    Args:
        bench: the study; nothing is spoilt if its training does not hold the healthy recording.
        fitted: its model with effects.
    """
    return bench.study.model.presence is not None and _healthy_error(bench, fitted) > AS_BEFORE


def _healthy_error(bench: Bench, fitted: Fitted) -> float:
    """The healthy recording's error over that of the parameters' own fit to it."""
    assert bench.bare is not None
    first = len(with_effects(bench.study.model, bench.data.train))
    return _size(fitted.train, first) / _size(bench.bare.train, 0)


def _explains(bench: Bench, fitted: Fitted) -> bool:
    left = bench.floor.beyond_own_error(bench.base.held_out, fitted.held_out, fitted.calm)
    return left <= LEFT


def fitted_beside_healthy(bench: Bench, row: Ranked) -> tuple[Bench, Ranked] | None:
    """The bench and a row with the healthy recording in the training.

    None if the study does not suit, or if that leaves no less of the recordings held out, by more
    than chance.

    Args:
        bench: the study.
        row: an effect that is fitted alone beside its model.
    """
    both = shared_bench(bench) if row.fitted is not None else None
    if both is None or row.fitted is None:
        return None
    other = replace(row, start=row.placement.own(row.fitted.train.values()))
    refit(both.study, both.data, both.base, other, fit_model)
    refuse_what_spoils(both, [other])
    if not other.accepted or other.fitted is None:
        return None
    fall = difference(row.fitted.held_out, other.fitted.held_out)
    less = fall.p_falls < STEP and fall.relative > MATERIAL
    return (both, other) if less else None


def _size(fit: Fit, first: int) -> float:
    """Error from a sample on, in standard deviations of noise."""
    residuals = fit.residuals.reshape(-1, fit.residuals.shape[-1])[first:]
    return float(np.sqrt(np.nanmean((residuals / fit.scale) ** 2)))
