"""Units of imported data and their conversion to SI.

SI value = factor · value + offset
"""

from dataclasses import dataclass

from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.units import UnitError, unit_of


@dataclass(frozen=True, slots=True)
class Conversion:
    """From one unit to SI: `unit` is the SI unit, `factor` [SI per unit], `offset` [SI]."""

    unit: str
    factor: float
    offset: float = 0.0


CHANNEL_UNITS = {
    "time": "s",
    "voltage": "V",
    "position": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "force": "N",
    "pressure": "Pa",
}
"""SI units of the channel names with a fixed quantity; units of other quantities are refused."""
_USUAL = {
    "s": "s, ms, us, min, h",
    "V": "V, mV, kV",
    "m": "m, mm, um, cm, in, ft",
    "m/s": "m/s, mm/s, in/s, km/h",
    "m/s^2": "m/s^2, mm/s^2, g0",
    "N": "N, mN, kN, lbf, kgf, gf",
    "Pa": "Pa, kPa, MPa, bar, mbar, psi",
}
AMBIGUOUS = {
    "g": "'g0' for standard gravity or 'gram'",
    "mg": "'mg0' for standard gravity or 'mgram'",
}
"""Both accelerations and masses are given in g, so the unit must be written unambiguously."""


def conversion(unit: str, channel: str, *, any_unit: bool = False) -> Conversion:
    """Conversion of values of `channel` from `unit` to SI.

    Args:
        unit: of the values.
        channel: its name.
        any_unit: whether names with a fixed quantity accept others, as a servo's position in rad.

    Raises:
        ImportDataError: the unit is unknown, ambiguous, or not one of the channel's kind.
    """
    if unit in AMBIGUOUS:
        raise ImportDataError(f"{channel}: found the unit {unit!r}, expected {AMBIGUOUS[unit]}")
    try:
        found = unit_of(unit)
    except UnitError as error:
        raise ImportDataError(f"{channel}: {error}") from None
    wanted = None if any_unit and channel != "time" else CHANNEL_UNITS.get(channel)
    if wanted is not None and found.dimension != unit_of(wanted).dimension:
        raise ImportDataError(
            f"{channel}: found the unit {unit!r}, expected one of {_USUAL[wanted]} or another unit"
            " of the same kind, or `any_unit = true` in the mapping"
        )
    si = wanted or ("" if found.si == "1" else found.si)
    return Conversion(si, float(found.factor), float(found.offset))
