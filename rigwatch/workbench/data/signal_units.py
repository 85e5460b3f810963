"""Units of recorded channels against those of a model's signals.

A channel that was recorded in mm is converted; one that measures something else is refused. A
channel without a unit is taken in the model's SI unit, as nothing else is known of it.
"""

import re

from rigwatch.physics.engine.equations import Input, Output
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import GRAM, UnitError, names_gram, unit_of


def in_si(values: FloatArray, unit: str) -> FloatArray:
    """The values of a channel in SI; as they are where its unit is unknown, see `check_unit`."""
    try:
        found = unit_of(unit)
    except UnitError:
        return values
    return values if found.plain else values * float(found.factor) + float(found.offset)


def check_unit(recorded: str, signal: Input | Output, channel: str, where: str) -> None:
    """Refuse a channel whose unit does not measure what the model's signal is.

    Args:
        recorded: the channel's unit, empty where none is known.
        signal: of the model.
        channel, where: what is read, and for what, for the error.

    Raises:
        ModelError: it measures something else, or its unit is unknown.
    """
    if not recorded:
        return
    wanted = signal.shown or signal.unit
    try:
        found = unit_of(recorded)
    except UnitError as error:
        raise ModelError(f"{where}: {channel}: {error}") from None
    if found.dimension != unit_of(wanted).dimension or _turns_for_angle(recorded, wanted):
        hint = f" ({GRAM})" if names_gram(recorded) else ""
        raise ModelError(
            f"{where}: found {channel} in [{recorded}], expected a unit of {wanted!r} such as"
            f" [{signal.unit}]{hint}: see the import's mapping and the model's unit"
        )


def _turns_for_angle(one: str, other: str) -> bool:
    """Whether one unit counts turns and the other angles: 1 Hz is 2π rad/s, of one dimension."""
    angle = re.compile("rad|deg|rpm|rev|°")
    return any("Hz" in a and angle.search(b) is not None for a, b in ((one, other), (other, one)))
