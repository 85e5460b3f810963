"""The holds of inputs that a study keeps with an accepted effect.

A hold that is chosen beside a model without the effect takes over some of what the effect does: an
input seems to act a sample late where a sensor is slow. So it is chosen once more, with the effect
in the model, before it is written to the study.
"""

from rigwatch.workbench.compare import Bench, Warm, with_horizon_of
from rigwatch.workbench.fit import held_as
from rigwatch.workbench.study import (
    RECORDINGS,
    Accepted,
    Study,
    append_effect,
    keep_holds,
    without_chosen_holds,
)


def with_kept_holds(study: Study, accepted: Accepted, bench: Bench, warm: Warm) -> Study:
    """The study with an effect, and with the horizon and the holds that it keeps.

    Of the holds chosen without the effect and with it, those with the smaller held-out error.

    Args:
        study: without the effect.
        accepted: the effect with its values.
        bench: of the study, with the holds chosen without the effect.
        warm: cache of fits; new fits are added to it.

    Raises:
        ModelError: data have changed, or a fit fails.
    """
    before = bench.study.holds
    plain = with_horizon_of(without_chosen_holds(study), bench.study)
    as_before = append_effect(keep_holds(held_as(plain, before)), accepted)
    # A hold chosen from a healthy recording does not depend on the effects.
    if not any(held.source == RECORDINGS for held in before.values()):
        return as_before
    free = warm.bench(append_effect(keep_holds(plain), accepted)).study.holds
    if all(free[n].hold == h.hold and free[n].late == h.late for n, h in before.items()):
        return as_before
    anew = append_effect(keep_holds(held_as(plain, free)), accepted)
    return min((as_before, anew), key=lambda kept: warm.comparison(kept).held_out_error)
