"""Checks units of recorded channels against those of a model's signals.

A channel recorded in mm is converted; one of another dimension is refused. A channel without a unit
is assumed to be in the model's SI unit.
"""

from rigwatch.physics.engine.equations import Input, Output
from rigwatch.wire.arrays import FloatArray
from rigwatch.wire.errors import ModelError
from rigwatch.wire.units import GRAM, UnitError, may_count_turns, names_gram, unit_of


def in_si(values: FloatArray, unit: str) -> FloatArray:
    """The values of a channel in SI; unchanged if its unit is unknown, see `check_unit`."""
    try:
        found = unit_of(unit)
    except UnitError:
        return values
    return values if found.plain else values * float(found.factor) + float(found.offset)


def check_unit(recorded: str, signal: Input | Output, channel: str, where: str) -> None:
    """Check that a channel's unit has the dimension of the model's signal.

    Args:
        recorded: the channel's unit, empty if none is known.
        signal: of the model.
        channel, where: names of channel and signal, for the error message.

    Raises:
        ModelError: the dimension differs, or the unit is unknown.
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


def _turns_for_angle(recorded: str, wanted: str) -> bool:
    """Whether one unit may count turns and the other angles: 1 Hz may be 2π rad/s."""
    return may_count_turns(recorded, wanted) or (
        "Hz" in wanted and may_count_turns(wanted, recorded)
    )
