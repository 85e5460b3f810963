"""Variants of the equations that healthy recordings ask for.

Equations that lack a law of the rig, as a loop that controls the pressures, may describe its
healthy motion nearly as well as the right ones: the motion follows from the drive, so that a wrong
response to the motion is made up for by a wrong response to the drive. A force that changes the
motion is then found by half. Where the equations leave more than the sensor's noise, each variant
of the model is therefore fitted briefly from the same values, and the best to its end. It is taken
if it leaves less of what follows the fitted parts of the recordings. Variants of the sensors are
not tried: fitted with the plant, a sensor absorbs what the laws of the plant lack.
"""

from collections.abc import Callable, Mapping, Sequence

from monitor.commissioning.equations.healthy_fit import HealthyFit, Stretches, fit_healthy
from rigwatch.physics.engine.compile import side_by_side
from rigwatch.physics.engine.equations import Model, neighbours, with_variants
from rigwatch.wire.errors import ModelError

AT_NOISE = 1.1
"""Ratio of the error to the sensor's noise up to which nothing is looked for."""
WORTH = 0.05
"""Least relative fall of the error, on what was not fitted, for which a variant is taken."""
ROUNDS = 2
"""Most variants taken."""


def fit_with_variants(
    model: Model, data: Stretches, say: Callable[[str], None]
) -> tuple[tuple[str, ...], HealthyFit]:
    """The variants that the recordings ask for, and the model with them, fitted.

    Args:
        model: without variants.
        data: healthy recordings.
        say: called with one line at each step.

    Raises:
        ModelError: the model itself cannot be fitted.
    """
    names: tuple[str, ...] = ()
    best = fit_healthy(model, data)
    for _ in range(ROUNDS):
        if not best.later > AT_NOISE:
            break
        further = [each for each in neighbours(model, names) if _suits(model, each, data.known)]
        if not further:
            break
        say(f"the equations leave {best.later:.2f} times the noise: trying {len(further)} variants")
        found = _best_of(model, further, data, best)
        if found is None or not found[1].later < (1.0 - WORTH) * best.later:
            break
        names, best = found
    return names, best


def _suits(model: Model, names: Sequence[str], known: Mapping[str, float]) -> bool:
    """Whether the model with these variants has all known parameters, and its own sensors."""
    changed = with_variants(model, names)
    return set(known) <= set(changed.parameters) and changed.outputs == model.outputs


def _best_of(
    model: Model, sets: Sequence[tuple[str, ...]], data: Stretches, at: HealthyFit
) -> tuple[tuple[str, ...], HealthyFit] | None:
    """The set of variants that leaves least after a brief fit, fitted to its end."""

    def tried(names: tuple[str, ...]) -> HealthyFit | None:
        changed = with_variants(model, names)
        same = {n for n, p in changed.parameters.items() if at.model.parameters.get(n) == p}
        start = {n: value for n, value in at.values.items() if n in same}
        try:
            return fit_healthy(changed, data, start, brief=True)
        except ModelError:
            return None

    briefs = side_by_side(tried, list(sets))
    made = [(names, fit) for names, fit in zip(sets, briefs, strict=True) if fit is not None]
    if not made:
        return None
    names, brief = min(made, key=lambda each: each[1].error)
    try:
        return names, fit_healthy(brief.model, data, brief.values)
    except ModelError:
        return None
