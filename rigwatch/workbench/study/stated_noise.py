"""Noise of a model's outputs that the study states, as from a sensor's data sheet or at rest."""

from collections.abc import Mapping

from rigwatch.physics.engine.equations import Model
from rigwatch.wire.errors import ModelError, nearest
from rigwatch.wire.units import unit_of


def noise_in_si(noise: Mapping[str, float], model: Model) -> dict[str, float]:
    """Standard deviations of outputs, converted from the units in which they are shown to SI.

    Args:
        noise: by output, as in the study's file.
        model: whose outputs they are.

    Raises:
        ModelError: the model has no such output.
    """
    found = {}
    for name, size in noise.items():
        if name not in model.outputs:
            raise ModelError(f"noise: found output {name!r}{nearest(name, model.outputs)}")
        output = model.outputs[name]
        found[name] = size * float(unit_of(output.shown or output.unit).factor)
    return found
