"""Ranks every effect at every port: scored along the fitted model, the best fitted and judged.

The score test compares the residual with all candidates' directions at once, after projecting out
the parameters already fitted. Its p-value allows for noise of any colour and for what a wrong model
leaves, and is corrected for the number of candidates. The best candidates are then fitted in
full. An effect is accepted only if the held-out error falls, over blocks, by more than chance.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rigwatch.workbench.data import Data, NoiseFloor
from rigwatch.workbench.fit import Fitted, fit_model, fit_with_retry
from rigwatch.workbench.ranking.acceptance import MATERIAL, NEAR
from rigwatch.workbench.ranking.candidates import candidates
from rigwatch.workbench.ranking.fit_selection import LEVEL, select_for_fit
from rigwatch.workbench.ranking.ranked import (
    SAME,
    Ranked,
    best_accepted,
    error_ratio,
    in_order,
    same_family,
)
from rigwatch.workbench.ranking.refitting import (
    Fitting,
    Progress,
    fit_each,
    fit_from,
    leaves_only_noise,
    no_progress,
    own_floor,
    refit,
    refit_all,
    refit_elsewhere,
    refit_from_given,
)
from rigwatch.workbench.ranking.same_drive import denied_sensors
from rigwatch.workbench.ranking.scoring import scored
from rigwatch.workbench.study import Study

AGAIN = 0.25
"""Share of the energy above the floor that an effect must explain, to first order, to be fitted
again if its fit may have ended in a local minimum."""
SEEMS = 0.75
"""Share of the residual, to first order, from which a refused effect is not what it seems."""
MUCH_WORSE = 1.5
"""Ratio of held-out errors too large to be caused by other missing physics favouring one effect.

Up to it another effect may be the right one, is fitted and may be named in place of the best.
"""
BEGUN_AGAIN = 3
"""Most rows that are begun once more from the given values."""
FAR_SIMPLER, HALF = 2, 0.5
"""Parameters less than the best's, and share of what it explains to first order, from which a law
at its port is fitted although others explain more."""
MOST_MORE = 6
"""Most rows that are fitted although others explain more, to first order."""


def rank(
    study: Study,
    data: Data,
    base: Fitted,
    floor: NoiseFloor,
    progress: Progress = no_progress,
    *,
    known: Sequence[Ranked] = (),
) -> list[Ranked]:
    """All effects at all ports, best first; the most promising are fitted and judged.

    Args:
        study, data, base: the study, its recordings and the fitted model.
        floor: noise floor of the held-out recordings.
        progress: called with a line of text as each fit begins.
        known: rows of an earlier ranking of fewer effects; what was fitted is not fitted again.
    """
    rows = scored(study, data, base, candidates(study, data.train))
    _take_known(rows, known, base)
    denied = denied_sensors(study, data)
    for row in rows:
        if row.port in denied:
            row.reason = row.failure = denied[row.port]
    kind = "dynamic" if study.model.states else "static"
    possible = [row for row in rows if not row.failure]
    # Along the motion windows are whole recordings; what a rough model leaves is its own error.
    free_run = not (data.along_motion or study.model.rough)
    far = free_run and floor.ratio(base.held_out) > NEAR and not base.determines_nothing
    chosen = select_for_fit(possible, kind, at_floor=floor.reached(base.held_out), far=far)
    enough = fit_each(study, data, base, floor, chosen, progress)
    if not enough:
        least = AGAIN * floor.above(base.train)
        likely = [row for row in chosen if row.explained > least]
        refit_elsewhere(study, data, base, likely, progress)
    _fit_skipped(study, data, base, rows, progress, fit_model if enough else fit_with_retry)
    while similar := _unfitted_similar(rows, floor):
        progress(f"fitting {similar.label}, which resembles the best")
        refit(study, data, base, similar, fit_model if enough else fit_with_retry)
    if free_run:
        _begin_again(study, data, base, rows, floor, progress)
        _begin_from_best(study, data, base, rows, floor, progress)
    rest = _far_simpler(rows)
    _tell(progress, rest, "which has fewer parameters than the best at its port")
    refit_all(study, data, base, rest, fit_model if enough else fit_with_retry)
    for other in _elsewhere(study, data, rows, floor):
        progress(f"fitting {other.label}, as the best may act there")
        refit(study, data, base, other, fit_from(in_order(rows)[0].fitted))
    rest = _simpler_or_equal(study, data, rows, floor)
    _tell(progress, rest, "as the best at its port leaves more than noise")
    refit_all(study, data, base, rest, fit_model)
    return in_order(rows)


def _tell(progress: Progress, rows: Sequence[Ranked], why: str) -> None:
    for row in rows:
        progress(f"fitting {row.label}, {why}")


def _begin_again(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    base: Fitted,
    rows: Sequence[Ranked],
    floor: NoiseFloor,
    progress: Progress,
) -> None:
    """Begin the best rows once more from the given values, until one leaves only noise.

    All have begun where the base model ended. Those that an earlier ranking has begun again are not
    fitted a third time.
    """
    tried = set[str]()
    for _ in range(BEGUN_AGAIN):
        fitted = [row for row in in_order(rows) if row.fitted is not None]
        waiting = [row for row in fitted if row.label not in tried]
        if not waiting or leaves_only_noise(study, data, floor, fitted[0]):
            return
        row = waiting[0]
        tried.add(row.label)
        if not row.begun_again:
            progress(f"fitting {row.label} again, starting from the given values")
            refit_from_given(study, data, base, row)


def _begin_from_best(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    base: Fitted,
    rows: Sequence[Ranked],
    floor: NoiseFloor,
    progress: Progress,
) -> None:
    """Begin rows that ended above the base model where the best one has the model's parameters.

    The base model's may be far off while an effect is missing, and only some that resemble it come
    back from there: sliding with presliding, say, and not dry friction itself.
    """
    likely = ((row, row.fitted) for row in rows if row.likely and row.fitted is not None)
    astray = [(row, found) for row, found in likely if found.train_error > base.train_error]
    for row, found in astray[:BEGUN_AGAIN]:
        best = in_order(rows)[0]
        if best.fitted is None or leaves_only_noise(study, data, floor, best):
            return
        progress(f"fitting {row.label} again, starting from the parameters beside {best.label}")
        begun = replace(row)
        refit(study, data, base, begun, fit_from(best.fitted))
        if begun.fitted is not None and begun.fitted.train_error < found.train_error:
            row.take(begun)


def _fit_skipped(  # noqa: PLR0917 -- they belong together
    study: Study,
    data: Data,
    base: Fitted,
    rows: Sequence[Ranked],
    progress: Progress,
    first: Fitting,
) -> None:
    """Fit effects that were skipped for others which then do not stand for them.

    Args:
        study, data, base, rows, progress: as in `rank`.
        first: fits what stands for an effect that cannot be fitted.
    """
    while spare := _substitute_of_failed(rows):
        progress(f"fitting {spare.label}, as the effect it resembles cannot be fitted")
        refit(study, data, base, spare, first)
    while spare := _substitute_of_vague(rows):
        progress(f"fitting {spare.label}, as the strength of the effect it resembles is open")
        refit(study, data, base, spare, fit_model)
    spares = _substitutes_of_refused(base, rows)
    _tell(progress, spares, "as the effect it resembles is refused")
    refit_all(study, data, base, spares, fit_model)
    spares = _skipped_for_far_worse(rows)
    _tell(progress, spares, "as what it resembles leaves far more than the best")
    refit_all(study, data, base, spares, fit_model)


def _skipped_for_far_worse(rows: Sequence[Ranked]) -> list[Ranked]:
    """Unfitted rows of the best's family, skipped for one that leaves much more than the best.

    A delay of the drive resembles a lag there to first order. If the best is the sensor's delay,
    that is as good, and the lag is not, the drive's must be tried, too.
    """
    best = best_accepted(rows)
    if best is None:
        return []
    most = MUCH_WORSE * best.held_out_error
    far = {r.label for r in rows if r.fitted is not None and r.held_out_error > most}
    waiting = [r for r in rows if r.fitted is None and not r.failure and r.fitted_instead in far]
    return [r for r in waiting if same_family(best, r) and _may_be_it(r)]


def _far_simpler(rows: Sequence[Ranked]) -> list[Ranked]:
    """Unfitted rows at the best's port with two parameters less that explain half as much.

    One with shape enough is any simpler law, as Bouc and Wen's loop is Dahl's, which to first order
    explains less than a contact of another shape.
    """
    best = best_accepted(rows)
    if best is None:
        return []
    waiting = [r for r in rows if r.fitted is None and not r.failure and r.port == best.port]
    far = [r for r in waiting if r.free + FAR_SIMPLER <= best.free and r.likely]
    return [r for r in far if r.explained >= HALF * best.explained]


def _take_known(rows: Sequence[Ranked], known: Sequence[Ranked], base: Fitted) -> None:
    """Store fits of an earlier ranking, of those that are fitted alone beside the base model."""
    alone = {
        row.label: row
        for row in known
        if row.fitted is not None and len(row.fitted.placements) == len(base.placements) + 1
    }
    for row in rows:
        if row.label in alone:
            row.take(alone[row.label])


def _elsewhere(study: Study, data: Data, rows: Sequence[Ranked], floor: NoiseFloor) -> list[Ranked]:
    """Unfitted rows with the best effect at other ports, if it leaves more than noise.

    Scores are along the base model's fit: where a drive clips its parameters may be so far off that
    they speak for a sensor that clips, and that a fit from there ends in a local minimum. What
    shifts time is tried elsewhere in any case: of a machine whose laws do not change, a late drive
    and a late sensor show the same.
    """
    best, left = _best_and_what_it_leaves(study, data, rows, floor)
    if best is None or (left <= floor.allowed and not best.placement.effect.time_shift):
        return []
    return [r for r in rows if r.effect == best.effect and r.fitted is None and not r.failure]


def _simpler_or_equal(
    study: Study, data: Data, rows: Sequence[Ranked], floor: NoiseFloor
) -> list[Ranked]:
    """Unfitted rows at the best's port, no less simple, if it leaves more than noise.

    A score is to first order in the strength: in a model that is far from linear, as a jet at a
    nearly empty tank, what a sensor's zero does to it is underrated. Few are asked here, so each
    counts that is significant by itself.
    """
    best, left = _best_and_what_it_leaves(study, data, rows, floor)
    # A short recording excuses what is left, but a rival that leaves less must be tried.
    if best is None or left <= floor.usual:
        return []
    waiting = [r for r in rows if r.fitted is None and not r.failure and not r.fitted_instead]
    likely = [r for r in waiting if r.port == best.port and _may_be_it(r)]
    return sorted((r for r in likely if r.free <= best.free), key=lambda r: r.p_value)[:MOST_MORE]


def _best_and_what_it_leaves(
    study: Study, data: Data, rows: Sequence[Ranked], floor: NoiseFloor
) -> tuple[Ranked | None, float]:
    """The best accepted row, and its held-out error over the floor; None without a fitted one."""
    best = best_accepted(rows)
    if best is None or best.fitted is None:
        return None, 0.0
    return best, own_floor(study, data, floor, best).ratio(best.fitted.held_out)


def _substitute_of_failed(rows: Sequence[Ranked]) -> Ranked | None:
    """A row skipped in favour of one whose fit then failed; None if there is none."""
    failed = {row.label for row in rows if row.failure}
    waiting = (row for row in rows if row.fitted is None and not row.failure)
    return next((row for row in waiting if row.fitted_instead in failed), None)


def _substitute_of_vague(rows: Sequence[Ranked]) -> Ranked | None:
    """A row skipped for one at its port whose strength the training leaves open; None without one.

    Similar are directions to first order. What a parameter of the model makes up for in one law, as
    a conductance does in convection, it may not in another.
    """
    vague = {row.label for row in rows if row.vague and not row.accepted}
    waiting = (row for row in rows if row.fitted is None and not row.failure)
    return next(
        (
            r
            for r in waiting
            if r.fitted_instead in vague and r.fitted_instead.endswith(f"@{r.port}")
        ),
        None,
    )


def _substitutes_of_refused(base: Fitted, rows: Sequence[Ranked]) -> list[Ranked]:
    """Rows skipped for refused ones that do not stand for them.

    Scores find two directions alike if hidden states begin anew in each window; what they do to
    states that continue may differ. And what explains most of the residual to first order and
    nothing of it when fitted is not what it looks like: a finite strength does something else.
    """
    fitted = [row for row in rows if row.fitted is not None and not row.accepted]
    refused = {row.label for row in fitted if base.train.continued or row.explained > SEEMS}
    waiting = [row for row in rows if row.fitted is None and not row.failure]
    return [r for r in waiting if r.fitted_instead in refused and _may_be_it(r)]


def _may_be_it(row: Ranked) -> bool:
    """Whether the score speaks for it: among few each counts that is significant by itself."""
    return row.likely or row.p_alone < LEVEL


def _unfitted_similar(rows: Sequence[Ranked], floor: NoiseFloor) -> Ranked | None:
    """An unfitted row similar to one that may be named; only a fit can decide between them.

    Similar are those whose directions are nearly the best's, to first order, and those skipped in
    favour of an effect that is nearly as good: it may be named as the simpler one. Above the noise
    floor also those parallel to it, and those that are similar to the best on many recordings. At
    it one of those that are parallel, and the others if that one leaves more: a lag of many samples
    is no delay, though to first order it is.
    """
    accepted = in_order([row for row in rows if row.accepted])
    if not accepted:
        return None
    best = accepted[0]
    waiting = {row.label: row for row in rows if row.fitted is None and not row.failure}
    alike = [(waiting[label], best) for label in best.alike if label in waiting]
    alike += _skipped_for_nearly_as_good(accepted, waiting)
    assert best.fitted is not None
    if floor.reached(best.fitted.held_out):
        unlike = next((row for row, other in alike if other.cosines[row.label] <= SAME), None)
        return unlike or _unfitted_parallel(best, rows, waiting)
    similar = [row for row, _ in alike]
    return next(iter(similar + _usually_similar(best, accepted, waiting)), None)


def _unfitted_parallel(
    best: Ranked, rows: Sequence[Ranked], waiting: Mapping[str, Ranked]
) -> Ranked | None:
    """A row parallel to the best to first order, unless one that is fitted leaves as little."""
    parallel = [row for row in rows if best.cosines.get(row.label, 0.0) > SAME]
    fitted = [row for row in parallel if row.fitted is not None]
    if any(row.accepted and error_ratio(best, row) <= 1 + MATERIAL for row in fitted):
        return None
    return next((row for row in parallel if row.label in waiting), None)


def _skipped_for_nearly_as_good(
    accepted: Sequence[Ranked], waiting: Mapping[str, Ranked]
) -> list[tuple[Ranked, Ranked]]:
    """Unfitted rows with those they resemble, of which the error is near that of the best."""
    most = MUCH_WORSE * accepted[0].held_out_error
    near = {row.label: row for row in accepted if row.held_out_error < most}
    return [
        (row, near[row.fitted_instead])
        for row in waiting.values()
        if row.fitted_instead in near and row.free <= near[row.fitted_instead].free
    ]


def _usually_similar(
    best: Ranked, accepted: Sequence[Ranked], waiting: Mapping[str, Ranked]
) -> list[Ranked]:
    """Unfitted rows that the library calls similar to the best, of which a similar one is accepted.

    Directions are to first order in a strength: where an effect decides most of the motion, that of
    its relatives may differ although they fit as well.
    """
    labels = [f"{name}@{best.port}" for name in best.placement.effect.confused_with]
    instead = {row.label for row in accepted}
    found = (waiting[label] for label in labels if label in waiting)
    return [row for row in found if row.fitted_instead in instead]
