"""Rarer effects that leave far less than the one named, or alone as little as a named set.

They are not ranked with the others, as more candidates make larger classes. Those like what is
named are tried here: what leaves only noise need not be what is missing.
"""

from collections.abc import Sequence
from dataclasses import replace

from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.contradicting import FAVOURED
from rigwatch.workbench.explain.only_training import SHOWN
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import (
    MATERIAL,
    Progress,
    Ranked,
    difference,
    error_ratio,
    in_order,
    refinements,
    refit,
)
from rigwatch.workbench.study import Study, told


def with_rarer_rivals(
    bench: Bench, rows: list[Ranked], verdict: Verdict, progress: Progress
) -> tuple[list[Ranked], Verdict]:
    """Ranking and verdict, with rarer effects like those named in a free run as rivals.

    What leaves nothing above the quietest band may still be the likeness of a rarer effect, as a
    leak is of an overflow that opens late, and two effects that of one, as a spring and a stop on
    both sides are of a stop on one.

    Args:
        bench: the study.
        rows: the ranking, to which the rivals are added.
        verdict: of which only `missing_effect` may change.
        progress: called with a line of text as each fit begins.
    """
    best = verdict.best
    free_run = not (bench.data.along_motion or bench.study.model.rough)
    if verdict.word != "missing_effect" or best is None or best.fitted is None or not free_run:
        return rows, verdict
    named = [row for row in rows if row.label in (best.label, *verdict.beside)]
    finer = refinements(bench.study, bench.data, bench.base, rows, named, likened=True)
    most = max((row.explained for row in named), default=0.0)
    likely = [r for r in finer if r.p_value < SHOWN and r.explained > FAVOURED * most]
    for row in likely:
        progress(f"fitting {row.label}, which the training resembles more than {best.label}")
        refit(bench.study, bench.data, bench.base, row)
    leaves_less = _no_worse if verdict.beside else _trains_far_better
    better = [row for row in likely if row.accepted and leaves_less(best, row)]
    if not better:
        return rows, verdict
    rivals = tuple(row.label for row in better)
    lowers = f"{' and '.join((*verdict.beside, best.label))} may be missing, or what is rarer"
    leaves = "leaves" if len(rivals) == 1 else "each leave"
    less = "as little alone" if verdict.beside else _of_training(best, better)
    text = f"{lowers} and like that: {', '.join(rivals)} {leaves} {less}"
    told_now = replace(verdict, word="undetermined", rivals=(*verdict.rivals, *rivals), text=text)
    return in_order([*rows, *better]), told_now


def _of_training(best: Ranked, better: Sequence[Ranked]) -> str:
    """What the rivals leave of the training at most, and what the best does."""
    assert best.fitted is not None
    most = max(row.fitted.train_error for row in better if row.fitted is not None)
    unit = best.fitted.told_in
    own, most = (told(error, unit) for error in (best.fitted.train_error, most))
    return f"{most:.3g} {unit} of the training, {best.label} {own:.3g}"


def tries_rarer(study: Study, *, along_motion: bool) -> bool:
    """Whether rarer effects are tried by themselves where no usual one explains the error.

    Args:
        study: as written, or on a base that was found.
        along_motion: how its recordings are predicted. On another base a parameter may act on no
            output, so that the study alone would not tell.
    """
    checked = along_motion and bool(study.file.healthy)
    return not (checked or study.model.rough)


def _trains_far_better(best: Ranked, row: Ranked) -> bool:
    """Whether a fit leaves far less of the training than the best's, and less of what is held out.

    Far less is a material fall of the error that is certainly more than chance.
    """
    assert best.fitted is not None
    assert row.fitted is not None
    trained = difference(best.fitted.train, row.fitted.train)
    held_out = difference(best.fitted.held_out, row.fitted.held_out)
    certain = trained.relative > MATERIAL and trained.p_falls < SHOWN
    return certain and held_out.mean > 0.0


def _no_worse(best: Ranked, row: Ranked) -> bool:
    """Whether a fit leaves no more than the best's beside its set, held out and of the training."""
    assert best.fitted is not None
    assert row.fitted is not None
    trained = row.fitted.train_error / best.fitted.train_error
    return max(trained, error_ratio(best, row)) < 1 + MATERIAL
