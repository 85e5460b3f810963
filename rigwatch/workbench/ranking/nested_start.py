"""Fits an effect that refines another also from where the simpler one ends.

Shape parameters of a detailed effect have local minima far from the best: one slider whose friction
falls with speed can take the speed for the stiffness. The simpler effect has few of them, and what
both share is right within what the detail changes, so it leads to the better minimum.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking.candidates import shapes_of
from rigwatch.workbench.ranking.ranked import Ranked, accepted_from
from rigwatch.workbench.ranking.refitting import fit_from, refit, refit_all
from rigwatch.workbench.ranking.scoring import rank_only
from rigwatch.workbench.study import Study


def refit_nested(study: Study, data: Data, base: Fitted, rows: Sequence[Ranked]) -> None:
    """`refit` for rows; those that refine an effect also from its fit, the better one is kept.

    Args:
        study, data, base: the study, its recordings and the fitted model.
        rows: the effects; their fits and the decisions are stored in them.
    """
    refit_all(study, data, base, rows)
    known, waiting = {row.label: row for row in rows}, {row.label for row in rows}
    for row in rows:
        _nest(study, data, base, row, known, waiting)


def _nest(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    base: Fitted,
    row: Ranked,
    known: dict[str, Ranked],
    waiting: set[str],
) -> None:
    """Fit a row again from the effect that it refines, which is fitted that way before."""
    if row.label not in waiting:
        return
    waiting.remove(row.label)
    simpler = _refined(study, data, base, row, known)
    if simpler is None:
        return
    if simpler.label not in known:
        refit(study, data, base, simpler)
        known[simpler.label] = simpler
        waiting.add(simpler.label)
    _nest(study, data, base, simpler, known, waiting)
    if simpler.fitted is None:
        return
    again = replace(row, start=row.start | _shared(row, simpler))
    refit(study, data, base, again, fit_from(simpler.fitted))
    found = again.fitted
    if found and (row.fitted is None or found.train_error < row.fitted.train_error):
        row.take(again)


def _refined(
    study: Study, data: Data, base: Fitted, row: Ranked, known: dict[str, Ranked]
) -> Ranked | None:
    """The effect that a row's effect refines, perhaps not fitted; None if their strengths differ.

    Nor is one that is in the model already a start for what comes beside it.
    """
    name, port = row.placement.effect.refines, row.port
    label = f"{name}@{port}"
    placed = {f"{accepted.effect}@{accepted.port}" for accepted in study.file.effects}
    if label in known:
        return known[label]
    if name not in study.effects or label in placed:
        return None
    if study.effects[name].strength != row.placement.effect.strength:
        return None
    found = shapes_of(study, data.train, name, port)
    return rank_only(study, data, base, found) if found else None


def _shared(row: Ranked, simpler: Ranked) -> dict[str, float]:
    """Values of the simpler effect's parameters that the row's effect has too."""
    own = row.placement.effect.parameters
    return {name: v for name, v in accepted_from(simpler).parameters.items() if name in own}
