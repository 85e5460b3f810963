"""The table of units: quantity and factor to SI of each.

SI value = factor · value + offset

Factors are exact fractions, so an SI unit does not change a bit of a value. `g` is the gram;
standard gravity is `g0` (or `gn`).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

Dimension = tuple[Fraction, ...]
"""Exponents of `BASES`."""
BASES = ("kg", "m", "s", "A", "K")

PREFIXES: dict[str, Fraction] = {
    "p": Fraction(1, 10**12),
    "n": Fraction(1, 10**9),
    "u": Fraction(1, 10**6),
    "µ": Fraction(1, 10**6),
    "m": Fraction(1, 1000),
    "c": Fraction(1, 100),
    "d": Fraction(1, 10),
    "h": Fraction(100),
    "k": Fraction(1000),
    "M": Fraction(10**6),
    "G": Fraction(10**9),
}

DEGREE = Fraction(math.radians(1.0))
INCH = Fraction("0.0254")
POUND = Fraction("0.45359237")
GRAVITY = Fraction("9.80665")
POUND_FORCE = POUND * GRAVITY
ATMOSPHERE = 101325
MERCURY = Fraction("133.322387415")
"""A millimetre of mercury, by convention at 13 595.1 kg/m³ [Pa]."""
RANKINE = Fraction(5, 9)


@dataclass(frozen=True, slots=True)
class Quantity:
    """One kind of quantity and its units.

    Attributes:
        name: in words.
        si: its SI unit, as values are kept.
        exponents: of the base units.
        units: factor to SI, by unit.
        prefixed: those of `units` that take the prefixes of `PREFIXES`.
        offsets: value of a unit's zero [SI], if not 0.
    """

    name: str
    si: str
    exponents: Mapping[str, int]
    units: Mapping[str, Fraction | int]
    prefixed: tuple[str, ...] = ()
    offsets: Mapping[str, Fraction] | None = None


QUANTITIES: tuple[Quantity, ...] = (
    Quantity(
        "pure number", "1", {}, {"1": 1, "": 1, "%": Fraction(1, 100), "ppm": Fraction(1, 10**6)}
    ),
    Quantity(
        "angle", "rad", {},
        {"rad": 1, "deg": DEGREE, "°": DEGREE, "rev": Fraction(2 * math.pi)}, ("rad",),
    ),
    Quantity("angular speed", "rad/s", {"s": -1}, {"rpm": 6 * DEGREE}),
    Quantity("frequency", "Hz", {"s": -1}, {"Hz": 1}, ("Hz",)),
    Quantity("time", "s", {"s": 1}, {"s": 1, "min": 60, "h": 3600}, ("s",)),
    Quantity(
        "length", "m", {"m": 1},
        {"m": 1, "in": INCH, "inch": INCH, "ft": 12 * INCH, "mil": INCH / 1000}, ("m",),
    ),
    Quantity(
        "volume", "m^3", {"m": 3}, {"l": Fraction(1, 1000), "L": Fraction(1, 1000)}, ("l", "L")
    ),
    Quantity("speed", "m/s", {"m": 1, "s": -1}, {"mph": Fraction("0.44704")}),
    Quantity(
        "acceleration", "m/s^2", {"m": 1, "s": -2}, {"g0": GRAVITY, "gn": GRAVITY}, ("g0", "gn")
    ),
    Quantity(
        "mass", "kg", {"kg": 1},
        {"g": Fraction(1, 1000), "gram": Fraction(1, 1000), "tonne": 1000, "lb": POUND,
         "lbm": POUND, "slug": POUND_FORCE / (12 * INCH)}, ("g",),
    ),
    Quantity(
        "force", "N", {"kg": 1, "m": 1, "s": -2},
        {"N": 1, "kgf": GRAVITY, "gf": GRAVITY / 1000, "lbf": POUND_FORCE,
         "kip": 1000 * POUND_FORCE}, ("N",),
    ),
    Quantity("torque", "N m", {"kg": 1, "m": 2, "s": -2}, {"Nm": 1}, ("Nm",)),
    Quantity(
        "pressure", "Pa", {"kg": 1, "m": -1, "s": -2},
        {"Pa": 1, "bar": 10**5, "atm": ATMOSPHERE, "psi": POUND_FORCE / INCH**2,
         "ksi": 1000 * POUND_FORCE / INCH**2, "Torr": Fraction(ATMOSPHERE, 760), "mmHg": MERCURY,
         "inHg": 1000 * INCH * MERCURY, "mmWC": GRAVITY, "cmWC": 10 * GRAVITY,
         "inWC": 1000 * INCH * GRAVITY}, ("Pa", "bar"),
    ),
    Quantity(
        "energy", "J", {"kg": 1, "m": 2, "s": -2}, {"J": 1, "Wh": 3600, "kWh": 3600000}, ("J",)
    ),
    Quantity("power", "W", {"kg": 1, "m": 2, "s": -3}, {"W": 1}, ("W",)),
    Quantity("current", "A", {"A": 1}, {"A": 1}, ("A",)),
    Quantity("charge", "C", {"A": 1, "s": 1}, {"C": 1}, ("C",)),
    Quantity("voltage", "V", {"kg": 1, "m": 2, "s": -3, "A": -1}, {"V": 1}, ("V",)),
    Quantity(
        "resistance", "ohm", {"kg": 1, "m": 2, "s": -3, "A": -2}, {"ohm": 1, "Ω": 1}, ("ohm", "Ω")
    ),
    Quantity("conductance", "S", {"kg": -1, "m": -2, "s": 3, "A": 2}, {"S": 1}, ("S",)),
    Quantity("inductance", "H", {"kg": 1, "m": 2, "s": -2, "A": -2}, {"H": 1}, ("H",)),
    Quantity("capacitance", "F", {"kg": -1, "m": -2, "s": 4, "A": 2}, {"F": 1}, ("F",)),
    Quantity("magnetic flux", "Wb", {"kg": 1, "m": 2, "s": -2, "A": -1}, {"Wb": 1}, ("Wb",)),
    Quantity("flux density", "T", {"kg": 1, "s": -2, "A": -1}, {"T": 1}, ("T",)),
    Quantity(
        "temperature", "K", {"K": 1},
        {"K": 1, "degC": 1, "°C": 1, "degF": RANKINE, "°F": RANKINE}, ("K",),
        {"degC": Fraction("273.15"), "°C": Fraction("273.15"),
         "degF": Fraction("459.67") * RANKINE, "°F": Fraction("459.67") * RANKINE},
    ),
    Quantity(
        "dynamic viscosity", "Pa s", {"kg": 1, "m": -1, "s": -1}, {"cP": Fraction(1, 1000)}
    ),
    Quantity("kinematic viscosity", "m^2/s", {"m": 2, "s": -1}, {"cSt": Fraction(1, 10**6)}),
)  # fmt: skip
"""All units that files may use, as well as their products, quotients and powers."""

IN_OTHER_WORDS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "hour": "h", "hours": "h", "hr": "h",
    "msec": "ms", "millis": "ms", "millisecond": "ms", "milliseconds": "ms", "usec": "us",
    "micros": "us", "minute": "min", "minutes": "min", "percent": "%", "meter": "m", "metre": "m",
    "inches": "inch", "feet": "ft", "grams": "gram", "newton": "N", "lbs": "lb", "pascal": "Pa",
    "volt": "V", "volts": "V", "amp": "A", "ampere": "A", "ohms": "ohm", "watt": "W",
    "degree": "deg", "degrees": "deg", "radian": "rad", "kelvin": "K", "celsius": "degC",
    "fahrenheit": "degF", "rps": "rev/s", "lpm": "l/min", "kph": "km/h", "sek": "s", "meters": "m",
    "metres": "m", "newtons": "N", "amps": "A", "amperes": "A", "watts": "W", "radians": "rad",
    "mmh2o": "mmWC", "cmh2o": "cmWC", "inh2o": "inWC", "inwg": "inWC", "in.wg": "inWC",
}  # fmt: skip
"""Other names of units, for which errors suggest the right one."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One unit of the table: `si` is the SI unit, `factor` [SI per unit], `offset` [SI]."""

    si: str
    dimension: Dimension
    factor: Fraction
    offset: Fraction = Fraction(0)


def _entries() -> dict[str, Entry]:
    """Every single unit by name; an unprefixed name takes precedence over a prefixed one."""
    plain: dict[str, Entry] = {}
    prefixed: dict[str, Entry] = {}
    for q in QUANTITIES:
        dimension = tuple(Fraction(q.exponents.get(base, 0)) for base in BASES)
        for name, factor in q.units.items():
            offset = (q.offsets or {}).get(name, Fraction(0))
            plain[name] = Entry(q.si, dimension, Fraction(factor), offset)
        prefixed |= {
            prefix + name: Entry(q.si, dimension, size * q.units[name])
            for name in q.prefixed
            for prefix, size in PREFIXES.items()
        }
    return prefixed | plain


ENTRIES: dict[str, Entry] = _entries()
"""Every single unit by name, prefixes included."""
