"""The units that imported data may come in, and how they become SI.

SI value = factor · value + offset
"""

import difflib
from dataclasses import dataclass

from rigwatch.wire.errors import ImportDataError


@dataclass(frozen=True, slots=True)
class Conversion:
    """From one unit to SI: `unit` is the SI unit, `factor` [SI per unit], `offset` [SI]."""

    unit: str
    factor: float
    offset: float = 0.0


INCH = 0.0254
POUND_FORCE = 4.4482216152605
STANDARD_GRAVITY = 9.80665
DEGREE = 0.017453292519943295

UNITS: dict[str, Conversion] = {
    "": Conversion("", 1.0),
    "1": Conversion("", 1.0),
    "%": Conversion("", 0.01),
    "s": Conversion("s", 1.0),
    "ms": Conversion("s", 1e-3),
    "us": Conversion("s", 1e-6),
    "µs": Conversion("s", 1e-6),
    "ns": Conversion("s", 1e-9),
    "min": Conversion("s", 60.0),
    "h": Conversion("s", 3600.0),
    "m": Conversion("m", 1.0),
    "cm": Conversion("m", 1e-2),
    "mm": Conversion("m", 1e-3),
    "um": Conversion("m", 1e-6),
    "µm": Conversion("m", 1e-6),
    "in": Conversion("m", INCH),
    "ft": Conversion("m", 12 * INCH),
    "m/s": Conversion("m/s", 1.0),
    "mm/s": Conversion("m/s", 1e-3),
    "in/s": Conversion("m/s", INCH),
    "m/s^2": Conversion("m/s^2", 1.0),
    "m/s2": Conversion("m/s^2", 1.0),
    "mm/s^2": Conversion("m/s^2", 1e-3),
    "in/s^2": Conversion("m/s^2", INCH),
    "g": Conversion("m/s^2", STANDARD_GRAVITY),
    "mg": Conversion("m/s^2", STANDARD_GRAVITY * 1e-3),
    "N": Conversion("N", 1.0),
    "mN": Conversion("N", 1e-3),
    "kN": Conversion("N", 1e3),
    "lbf": Conversion("N", POUND_FORCE),
    "kgf": Conversion("N", STANDARD_GRAVITY),
    "N m": Conversion("N m", 1.0),
    "Nm": Conversion("N m", 1.0),
    "Pa": Conversion("Pa", 1.0),
    "hPa": Conversion("Pa", 1e2),
    "kPa": Conversion("Pa", 1e3),
    "MPa": Conversion("Pa", 1e6),
    "mbar": Conversion("Pa", 1e2),
    "bar": Conversion("Pa", 1e5),
    "psi": Conversion("Pa", POUND_FORCE / INCH**2),
    "atm": Conversion("Pa", 101325.0),
    "V": Conversion("V", 1.0),
    "mV": Conversion("V", 1e-3),
    "uV": Conversion("V", 1e-6),
    "kV": Conversion("V", 1e3),
    "A": Conversion("A", 1.0),
    "mA": Conversion("A", 1e-3),
    "kg": Conversion("kg", 1.0),
    "Hz": Conversion("Hz", 1.0),
    "kHz": Conversion("Hz", 1e3),
    "rad": Conversion("rad", 1.0),
    "deg": Conversion("rad", DEGREE),
    "rad/s": Conversion("rad/s", 1.0),
    "deg/s": Conversion("rad/s", DEGREE),
    "rpm": Conversion("rad/s", 6 * DEGREE),
    "K": Conversion("K", 1.0),
    "degC": Conversion("K", 1.0, 273.15),
}

CHANNEL_UNITS = {
    "time": "s",
    "voltage": "V",
    "position": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "force": "N",
    "pressure": "Pa",
}
"""SI units of the channel names that have a meaning here: no other unit is taken for them."""


def conversion(unit: str, channel: str) -> Conversion:
    """How values of `channel` in `unit` become SI.

    Raises:
        ImportDataError: the unit is unknown, or not one of the channel's kind.
    """
    found = UNITS.get(unit)
    if found is None:
        close = difflib.get_close_matches(unit, UNITS, 1)
        expected = f"{close[0]!r}?" if close else f"one of {', '.join(filter(None, UNITS))}"
        raise ImportDataError(f"{channel}: found the unknown unit {unit!r}, expected {expected}")
    wanted = CHANNEL_UNITS.get(channel)
    if wanted is not None and found.unit != wanted:
        usable = ", ".join(name for name, item in UNITS.items() if item.unit == wanted)
        raise ImportDataError(f"{channel}: found the unit {unit!r}, expected one of {usable}")
    return found
