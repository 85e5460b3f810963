"""Refines the best effect if it leaves much: elective effects that describe it in more detail.

Elective effects are not ranked with the others, as more candidates make larger classes. If the best
effect is the right kind of physics but too simple, for example a guide that binds without
presliding, its refinements decide whether the rest of the error is the same physics or another.
"""

from collections.abc import Sequence

from rigwatch.workbench.data import Data
from rigwatch.workbench.fit import Fitted
from rigwatch.workbench.ranking.candidates import candidates, refining
from rigwatch.workbench.ranking.ranked import Ranked, in_order
from rigwatch.workbench.ranking.refitting import Progress, refit
from rigwatch.workbench.ranking.scoring import scored
from rigwatch.workbench.study import Study

REST = 0.25
"""Share of the energy left by an effect that its refinement must explain, to first order."""
MOST = 3
"""Refinements that are fitted: to first order, where a shape begins, they hardly differ."""


def with_refinements(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    base: Fitted,
    rows: Sequence[Ranked],
    best: Ranked,
    progress: Progress,
) -> list[Ranked]:
    """The ranking with refinements of its best effect, fitted and judged.

    Args:
        study, data, base: the study, its recordings and the fitted model.
        rows: the ranking; the rows get their cosines with the refinements.
        best: its best effect.
        progress: called with a line of text as each fit begins.
    """
    known = refinements(study, data, base, rows, (best,), likened=True)
    added = sorted(known, key=lambda row: -row.explained)[:MOST]
    for row in added:
        progress(f"fitting {row.label}, which refines {best.label}")
        refit(study, data, base, row)
    return in_order([*rows, *added])


def refinements(
    study: Study,
    data: Data,
    base: Fitted,
    rows: Sequence[Ranked],
    refined: Sequence[Ranked],
    *,
    likened: bool = False,
) -> list[Ranked]:
    """Refinements of some effects that are not ranked yet, scored together with all others.

    Args:
        study, data, base: the study, its recordings and the fitted model.
        rows: the ranking; the rows get their cosines with the refinements.
        refined: the effects.
        likened: include elective effects that are similar to them, see `refining`.
    """
    more = [
        candidate
        for row in refined
        for candidate in refining(study, data.train, row.effect, row.port, likened=likened)
    ]
    new = {candidate.label for candidate in more} - {row.label for row in rows}
    if not new:
        return []
    found = scored(study, data, base, [*candidates(study, data.train), *more])
    added = [row for row in found if row.label in new]
    for row in added:
        for other in rows:
            other.cosines[row.label] = row.cosines.get(other.label, 0.0)
            other.signed_cosines[row.label] = row.signed_cosines.get(other.label, 0.0)
    return added


def promises_more(refined: float, coarse: float) -> bool:
    """Whether a refinement explains so much more, to first order, that it is worth a fit.

    Args:
        refined, coarse: shares of the residual's energy that are explained with and without it.
    """
    return refined - coarse > REST * (1 - coarse)
