"""Selects the base of a study that its healthy recordings support.

A verdict is only as good as the base model. The model is fitted to the first part of the healthy
recordings and judged on the rest. Variants of its laws and effects that a healthy machine has are
then added one at a time, best first, as long as the error on the rest falls, over blocks, by more
than chance. A variant with fewer parameters is taken if it does equally well. A variant may replace
those of its group that it excludes. A fit that ends above that of a base with less in it is begun
anew from that base's values, so that no variant is refused for a minimum of another.

Along the measured motion every candidate is fitted briefly, to the beginning of the recording.
"""

from dataclasses import dataclass, replace

from rigwatch.physics.engine.equations import check_variants
from rigwatch.physics.engine.fit import Recording
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare.bases.base_fit import Base
from rigwatch.workbench.compare.bases.base_step import AT_NOISE, BaseSearch, improves
from rigwatch.workbench.data import Data, predicts_along_motion, prepare
from rigwatch.workbench.ranking import Progress, no_progress
from rigwatch.workbench.study import Study, check_data, varied

FIT_SHARE = 0.6
"""Share of a single healthy recording used for fitting; the rest decides."""
ROUNDS = 4
"""Largest number of variants and elements added."""

NO_HEALTHY = (
    "found no healthy recording, expected one: record a run with nothing wrong and list it under"
    " [[healthy]] in the study"
)


@dataclass(frozen=True)
class Bases:
    """Result of the search for a base.

    Attributes:
        enough: the simplest base that no other tried beats.
        ranking: all bases fitted to the whole recording, best first.
        remarks: notes for the user.
        start: fitted values of the parameters of `enough`, by name in SI.
    """

    enough: Base
    ranking: list[Base]
    remarks: list[str]
    start: dict[str, float]


def find_base(study: Study, progress: Progress = no_progress, *, enough: float = AT_NOISE) -> Bases:
    """Search for the variants of the study's model that its healthy recordings support.

    Args:
        study: the study; its accepted effects are ignored.
        progress: called with a line of text as each fit begins.
        enough: ratio of the held-out error to its noise at which nothing more is looked for along
            the measured motion.

    Raises:
        ModelError: there is no healthy recording, the model cannot be fitted, or it has no variants
            and runs free, so that no elements are searched for.
    """
    check_data(study)
    study = varied(study, ()).with_effects(())
    if not (study.model.variants or predicts_along_motion(study)):
        raise ModelError(f"{study.file.model}: found no [variants], expected some to choose from")
    check_variants(study.model, study.file.model)
    data = prepare(study)
    if data.healthy is None:
        raise ModelError(f"{study.folder}: {NO_HEALTHY}")
    split = _split_healthy(data.healthy, data.horizon)
    search = BaseSearch(split, study.file.start, enough, progress)
    progress("fitting the unmodified model")
    best = search.first(study)
    tried = [best]
    for _ in range(ROUNDS):
        fits = search.one_step(best)
        tried += fits
        better = [one for one in fits if improves(best, one)]
        if not better:
            break
        best = min(better, key=lambda one: one.base.held_out_error)
    ranking = sorted((one.base for one in tried), key=lambda base: base.held_out_error)
    values = best.fitted.train.values()
    start = {name: values[name] for name in best.fitted.compiled.system.free}
    return Bases(best.base, ranking, list(best.data.remarks), start)


def _split_healthy(healthy: Recording, horizon: int) -> Data:
    """Splits the healthy data: the last of several recordings, or the end of one, is held out."""
    parts = healthy.parts or (len(healthy),)
    if len(parts) > 1:
        cut = sum(parts[:-1])
    else:
        cut = max(round(FIT_SHARE * len(healthy)) // horizon, 1) * horizon
    if len(healthy) - cut < horizon:
        raise ModelError(
            f"healthy: found {len(healthy) * healthy.dt:.3g} s, expected at least two horizons of"
            f" {horizon * healthy.dt:g} s: one to fit and one that decides"
        )
    fitted, judged = _cut(healthy, 0, cut), _cut(healthy, cut, len(healthy))
    # As in every other step the whole healthy motion determines the sensors' lateness and corner.
    return Data(fitted, judged, healthy, horizon, ())


def _cut(whole: Recording, begin: int, end: int) -> Recording:
    cut = whole.stretch(begin, end)
    thinning = replace(whole.thinning, parts=cut.parts) if whole.thinning else None
    return replace(cut, thinning=thinning)
