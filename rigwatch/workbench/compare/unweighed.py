"""Remark on a strength that depends on a known parameter, such as the mass, that nobody determined.

The acceleration shows a force only as a share of the moving mass, so a force is wrong by as many
percent as the mass is.
"""

from rigwatch.physics.engine.equations import Model, Placement
from rigwatch.workbench.compare.preparation import Bench
from rigwatch.workbench.compare.uncertainty_budget import by_known
from rigwatch.workbench.fit import Fitted

MATTERS = 0.2
"""Percent of a strength per percent of a known parameter from which the user is told."""


def unweighed(bench: Bench, placement: Placement, fitted: Fitted) -> list[str]:
    """Remarks on known parameters that an effect's strength depends on, if the study gives none.

    Args:
        bench: the study.
        placement: the effect named.
        fitted: the model with it.
    """
    model, values = bench.study.model, fitted.train.values()
    given = bench.study.file.start
    if not any(p.deviation and name not in given for name, p in model.parameters.items()):
        return []
    own = placement.effect.parameters[placement.effect.strength]
    strength = placement.prefix + placement.effect.strength
    # A fault of the sensor whose motion drives the model is no parameter of the fit.
    found, size = [], values.get(strength, own.neutral) - own.neutral
    for name, slopes in by_known(bench.study, bench.data, fitted).items():
        share = slopes.get(strength, 0.0) * values[name] / size if size else 0.0
        if name not in given and abs(share) >= MATTERS:
            label = f"{placement.effect.strength} of {placement.name}@{placement.port}"
            found.append(f"{label} moves by {share:.2g} % for each percent of {_told(model, name)}")
    return found


def _told(model: Model, name: str) -> str:
    p = model.parameters[name]
    return (
        f"{name} ({p.meaning or 'a known parameter'}), taken from the model file as {p.value:.4g}"
        f" {p.unit}: determine it and give it under [start] in the study"
    )
