"""Remark on a strength that depends on a known parameter, such as the mass, that nobody determined.

The acceleration shows a force only as a share of the moving mass, so a force is wrong by as many
percent as the mass is. The ratio of the two does not depend on the mass, and is given with an
interval of its own.
"""

from collections.abc import Mapping

from rigwatch.physics.engine.equations import Model, Placement
from rigwatch.workbench.compare.preparation import Bench
from rigwatch.workbench.compare.uncertainty_budget import by_known
from rigwatch.workbench.fit import Fitted, values

MATTERS = 0.2
"""Percent of a strength per percent of a known parameter from which the user is told."""
IN_PROPORTION = 0.1
"""Largest difference of that from 1 at which the ratio of the two is given."""


def unweighed(
    bench: Bench, placement: Placement, fitted: Fitted, added_variances: Mapping[str, float]
) -> list[str]:
    """Remarks on known parameters that an effect's strength depends on, if the study gives none.

    Args:
        bench: the study.
        placement: the effect named.
        fitted: the model with it.
        added_variances: of its parameters, by name.
    """
    model, at = bench.study.model, fitted.train.values()
    given = bench.study.file.start
    if not any(p.deviation and name not in given for name, p in model.parameters.items()):
        return []
    own = placement.effect.parameters[placement.effect.strength]
    strength = placement.prefix + placement.effect.strength
    # A fault of the sensor whose motion drives the model is no parameter of the fit.
    found, size = list[str](), at.get(strength, own.neutral) - own.neutral
    for name, slopes in by_known(bench.study, bench.data, fitted).items():
        slope = slopes.get(strength, 0.0)
        share = slope * at[name] / size if size else 0.0
        if name not in given and abs(share) >= MATTERS:
            label = f"{placement.effect.strength} of {placement.label}"
            text = f"{label} moves by {share:.2g} % for each percent of {_told(model, name)}"
            if abs(share - 1) <= IN_PROPORTION and not own.neutral:
                by_mass = (slope * model.parameters[name].deviation) ** 2
                rest = {**added_variances, strength: added_variances[strength] - by_mass}
                text += f"; the recordings alone show {_ratio(fitted, strength, name, rest)}"
            found.append(text)
    return found


def _ratio(fitted: Fitted, strength: str, name: str, rest: Mapping[str, float]) -> str:
    """A strength over a known parameter, with its interval for other variances, in words."""
    found, over = values(fitted.train, rest)[strength], fitted.train.values()[name]
    low, high = (end / over for end in found.interval or (found.value, found.value))
    unit = f"{found.unit} per {fitted.compiled.system.parameters[name].unit}"
    return f"{found.value / over:.3g} {unit} ({low:.3g} … {high:.3g})"


def _told(model: Model, name: str) -> str:
    p = model.parameters[name]
    return (
        f"{name} ({p.meaning or 'a known parameter'}), taken from the model file as {p.value:.4g}"
        f" {p.unit}: determine it and give it under [start] in the study"
    )
