"""Finds inputs that are recorded a sample late, in the rows after those from which they act.

Such a model answers before its input changes, which no effect explains: friction, play or a lag all
come later, and stand in for each other until the rows are in order. A model file says that an input
is held, but not in which row a log has its value. So the model is fitted with both orders, and the
later one is taken only if the error falls much, in training and held out. With effects accepted the
order stays: a wrong one among them may be mended by a wrong order.

Where a controller's command follows the motion, an earlier command damps it, so that a later row
may stand for missing drag; so it may for eddy currents, beside which a coil's current rises at
once. If more than noise is left, each order is asked what its most likely effects leave, and the
given one stays where they leave less with it.
"""

from dataclasses import replace

from rigwatch.physics.engine.fit import Fit, Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.data import (
    Data,
    held_out_floor,
    predicts_along_motion,
    scale_of_several,
    with_next_rows,
)
from rigwatch.workbench.fit import Fitted, fit_base, fit_model
from rigwatch.workbench.ranking import difference, rank_all, refit
from rigwatch.workbench.study import HEALTHY, RECORDINGS, Held, Study

MUCH = 0.1
"""Relative fall of the rms error that is required."""
LEVEL = 1e-3
"""Largest probability that chance lowers either error so far."""
MOST_FITTED = 2
"""Effects that are fitted with each order."""


def with_row_order(study: Study, data: Data) -> tuple[Study, Data]:
    """The study and its data, with the inputs that are recorded a sample late put right.

    Args:
        study: opened, with its horizon.
        data: prepared for its unmodified model.

    Raises:
        ModelError: the model cannot be fitted.
    """
    names = _in_doubt(study)
    if not names:
        return study, data
    own = data.of_healthy or data
    scale = scale_of_several(own.train)
    before, ordered = fit_base(study, own, scale), _ordered(study, own, names)
    after = _fitted_again(study, ordered, before, scale)
    if after is None or not _much_better(before, after):
        return study, data
    if data.healthy is None and _explains_more_as_given(study, (own, before), (ordered, after)):
        return study, data
    source = RECORDINGS if data.healthy is None else HEALTHY
    ratio = after.train_error / before.train_error
    found = {name: Held("zero", -1.0, -own.train.dt, source, ratio) for name in names}
    return replace(study, holds={**study.holds, **found}), _ordered(study, data, names)


def _in_doubt(study: Study) -> list[str]:
    """Driving inputs that the model file calls held; none if the study says more or has effects."""
    model, file = study.model, study.file
    if file.hold or file.late or file.effects or not model.states or model.rough:
        return []
    if predicts_along_motion(study):
        return []
    return [n for n in model.driving() if model.held(n) == "zero" and not model.inputs[n].late]


def _fitted_again(
    study: Study, ordered: Data, before: Fitted, scale: FloatArray | None
) -> Fitted | None:
    """The fit with the rows put right; None if it fails."""
    start = before.train.values()
    try:
        return fit_model(study, ordered, before.placements, start, scale, base=before)
    except ModelError:
        return None


def _ordered(study: Study, data: Data, names: list[str]) -> Data:
    def put_right(recording: Recording) -> Recording:
        return with_next_rows(study.model, recording, names)

    return replace(
        data,
        train=put_right(data.train),
        held_out=put_right(data.held_out),
        healthy=data.healthy and put_right(data.healthy),
        openings=data.openings and put_right(data.openings),
    )


def _explains_more_as_given(
    study: Study, given: tuple[Data, Fitted], later: tuple[Data, Fitted]
) -> bool:
    """Whether an effect leaves much less with the rows as they are than any with later ones."""
    data, after = later
    floor = held_out_floor(study, data, after.train, after.held_out)
    if floor.reached(after.held_out) and floor.of_training.reached(after.train):
        return False
    best = _best_effect(study, *given)
    if best is None or not _much_better(after, best):
        return False
    other = _best_effect(study, *later)
    return other is None or _leaves_much_less(other, best)


def _best_effect(study: Study, data: Data, base: Fitted) -> Fitted | None:
    """The fit with the effect, of those that explain most to first order, that leaves least."""
    rows = [row for row in rank_all(study, data, base) if not row.failure]
    likely = sorted(rows, key=lambda row: -row.explained)[:MOST_FITTED]
    for row in likely:
        refit(study, data, base, row, fit_model)
    fits = [row.fitted for row in likely if row.fitted is not None and row.accepted]
    return min(fits, key=lambda fitted: fitted.train_error, default=None)


def _much_better(before: Fitted, after: Fitted) -> bool:
    sides = (before.train, after.train), (before.held_out, after.held_out)
    return all(_falls_much(*fits) for fits in sides)


def _leaves_much_less(one: Fitted, other: Fitted) -> bool:
    """Whether the other leaves much less of training or held out, and of neither more.

    Slow recordings hardly show in which row an input acts.
    """
    sides = (one.train, other.train), (one.held_out, other.held_out)
    more = any(difference(*fits).relative < 0.0 for fits in sides)
    return not more and any(_falls_much(*fits) for fits in sides)


def _falls_much(before: Fit, after: Fit) -> bool:
    found = difference(before, after)
    return found.relative > MUCH and found.p_falls < LEVEL
