"""Whether changed parameters of the model explain a residual better than the effect named.

A healthy recording fixes the model's own parameters. A fault may change what they stand for: a
clogged silencer, a supply that sags, a leaking line. No effect of the library describes that, but
one that resembles it explains most of the residual, as a gain of a sensor does. The model without
the effect, its kept parameters free again, then leaves less of the held-out recordings. A true
effect that is in the library leaves nothing that these parameters could explain beside it, if the
model is right. A model that is a little wrong is less wrong with other parameters along another
motion, as beside a spring that holds it back. But a fault changes one thing, which one parameter
follows: of lower supplies one area leaves as little as a leak does, of springs no parameter but the
model's own spring comes near. So an effect stands that no single parameter comes near.
"""

from dataclasses import replace

from rigwatch.physics.engine.equations import Model
from rigwatch.physics.engine.fit import with_effects
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.rough_verdict import SHARE, SHARE_ALONE
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit import Fitted, fit_model, with_free, with_kept_free
from rigwatch.workbench.ranking import Progress, difference

THE_SAME = 1e-3
"""Relative difference of errors that two names of the same physics leave."""
CHANCE = 0.1
"""One-sided level at which changed parameters are better: it is higher than that of accepting an
effect, as a doubt needs less evidence than a name.
"""
CERTAIN = 1e-3
"""The same against what leaves no more than noise, as two effects do, or one beside parameters that
are shared with the healthy recording: the parameters, of which there are many, also explain a
little of what the base leaves of the healthy rig.

Lower supplies of three rigs that nobody here had built look like leaks beside shared parameters,
and changed ones leave less with p of 3e-6 to 6e-6. Of places where friction binds they leave far
more.
"""


def undetermined_if_parameters_changed(bench: Bench, found: Verdict, progress: Progress) -> Verdict:
    """The verdict, undetermined if the model's own parameters explain more than what is named.

    Args:
        bench: a study along the measured motion.
        found: the verdict on effects.
        progress: called with a line of text as the fit begins.
    """
    best = found.best
    if found.word != "missing_effect" or bench.study.kept is None or best is None:
        return found
    fitted = found.together or best.fitted
    little = bool(found.together) or bench.study.model.presence is not None
    # Of one effect: what may be left for the parameters to explain beside it.
    if fitted is None or not (little or _left(bench, fitted) > SHARE):
        return found
    named = " and ".join([best.label, *found.second[:1]])
    progress(f"comparing {named} with changed parameters of the model")
    changed = _refitted(bench, with_kept_free(bench.study.model))
    if changed is None or not _explains_more(bench, fitted, changed, little=little):
        return found
    # Two things may have changed where one effect leaves more than one that acts alone may.
    stands = not found.together and _left(bench, fitted) <= SHARE_ALONE
    if stands and not _one_comes_near(bench, fitted):
        return found
    unit = bench.base.told_in
    text = (
        f"{named} {'lower' if found.together else 'lowers'} the held-out error to"
        f" {fitted.told_error:.3g}, changed"
        f" parameters of the model itself to {changed.told_error:.3g} {unit}: something that they"
        " stand for may have changed since the healthy recording, such as pressures, lines or"
        " friction of the healthy rig"
    )
    return replace(found, word="undetermined", text=text)


def _one_comes_near(bench: Bench, named: Fitted) -> bool:
    """Whether one kept parameter, free alone, leaves hardly more than the effect named.

    One that leaves the same is the effect itself, as the model's own spring is.
    """
    model, near = bench.study.model, _left(bench, named) + SHARE
    kept = (name for name, p in model.parameters.items() if p.kept)
    fits = (_refitted(bench, with_free(model, [name])) for name in kept)
    others = (fit for fit in fits if fit is not None and not _is_as_large(fit, named))
    return any(_left(bench, fit) <= near for fit in others)


def _is_as_large(one: Fitted, other: Fitted) -> bool:
    return abs(one.held_out_error / other.held_out_error - 1) < THE_SAME


def _refitted(bench: Bench, model: Model) -> Fitted | None:
    """The study's model without the effect, some kept parameters free; None if it has no fit."""
    loose = replace(bench.study, model=model)
    data = replace(bench.data, train=with_effects(bench.study.model, bench.data.train))
    start, scale = bench.base.train.values(), bench.base.train.scale
    try:
        return fit_model(loose, data, bench.base.placements, start, scale)
    except ModelError:
        return None


def _explains_more(bench: Bench, named: Fitted, changed: Fitted, *, little: bool) -> bool:
    """Whether it explains more than what leaves little, or a share that one alone may not leave."""
    if not bench.floor.reached(changed.held_out):
        return False
    falls = difference(named.held_out, changed.held_out).p_falls
    more = _left(bench, named) - _left(bench, changed)
    return falls < CERTAIN if little else more > SHARE and falls < CHANCE


def _left(bench: Bench, fitted: Fitted) -> float:
    """Share of the error's energy above the floor that a fit leaves."""
    return bench.floor.left_over(bench.base.held_out, fitted.held_out)
