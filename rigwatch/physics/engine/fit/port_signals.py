"""The signals at an effect's port, computed from the channels of a recording."""

from collections.abc import Mapping

import numpy as np

from rigwatch.physics.engine.compile import evaluated
from rigwatch.physics.engine.equations import (
    RATE,
    TIME,
    Placement,
    System,
    arriving,
)
from rigwatch.wire.arrays import FloatArray

Signals = dict[str, FloatArray]


def port_signals(  # noqa: PLR0917 -- they belong together
    system: System,
    placement: Placement,
    inputs: FloatArray,
    states: FloatArray,
    time: FloatArray,
    spacing: FloatArray,
    values: Mapping[str, float],
) -> Signals:
    """The signals at an effect's port, computed from the channels.

    Args:
        system: a model with the effect.
        placement: the effect.
        inputs: shape (n, inputs).
        states: from the channels, shape (n, states).
        time: of each sample, shape (n,) [s].
        spacing: time from each sample to the next, shape (n,) [s].
        values: parameters by name.
    """
    port = system.model.ports[placement.entry]
    known: Signals = {TIME: time}
    known |= dict(zip(system.states, states.T, strict=True))
    known |= dict(zip(system.model.inputs, inputs.T, strict=True))

    def along(text: str) -> FloatArray:
        return evaluated(text, known, values, f"port {placement.port}")

    # In the system's order each port comes after those that its signal depends on.
    for name in system.ports:
        other = system.model.ports[name]
        if other.kind != "sensor":
            force = other.kind == "force"
            known[name] = np.zeros(len(inputs)) if force else along(arriving(system.model, other))
    found = {name: along(variable.expression) for name, variable in port.variables.items()}
    if port.kind != "force":
        found["u"] = along(arriving(system.model, port))
        found[RATE] = np.asarray(np.gradient(found["u"]) / spacing, np.float64)
    return {TIME: known[TIME], **found}
