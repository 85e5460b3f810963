"""An effect fitted to the training and the healthy recording together, see `beside_healthy.py`."""

from dataclasses import replace

from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.beside_healthy import describing_healthy, may_share
from rigwatch.workbench.compare.preparation import Bench, beside_healthy
from rigwatch.workbench.fit import fit_model
from rigwatch.workbench.ranking import MATERIAL, STEP, Ranked, difference, refit


def fitted_beside_healthy(bench: Bench, row: Ranked) -> tuple[Bench, Ranked] | None:
    """The bench and a row with the healthy recording in the training.

    None if the study does not suit, or if that leaves no less of the recordings held out, by more
    than chance.

    Args:
        bench: the study.
        row: an effect that is fitted alone beside its model.
    """
    if row.fitted is None or not may_share(bench.study, bench.data):
        return None
    try:
        both = beside_healthy(bench)
    except ModelError:
        return None
    other = replace(row, start=row.placement.own(row.fitted.train.values()))
    refit(both.study, both.data, both.base, other, fit_model)
    assert both.bare is not None
    describing_healthy(both.study, both.data, both.bare.train, [other])
    if not other.accepted or other.fitted is None:
        return None
    fall = difference(row.fitted.held_out, other.fitted.held_out)
    less = fall.p_falls < STEP and fall.relative > MATERIAL
    return (both, other) if less else None
