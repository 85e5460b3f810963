"""Hidden effects and faults of the rig: one declaration each, read by the kernels by name.

A declaration states what the effect does, where it acts, the value at which it is absent
(`neutral`) and a visible strength (`typical`). A new effect needs a line here and its line of
physics.
"""

import difflib
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Place = Literal["load", "piston", "actuator", "pneumatics", "voltage", "position", "acceleration"]


ANY = -np.inf
LONGEST_DELAY = 0.45
"""The delay lines' length [s] at 256 Hz."""


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect that can be switched, ramped and scheduled.

    `low` and `high` bound valid values, `dry` marks forms of dry friction, and `needs` names
    effects that must be present for this one to show.
    """

    name: str
    unit: str
    place: Place
    does: str
    typical: float
    neutral: float = 0.0
    low: float = 0.0
    high: float = np.inf
    dry: bool = False
    needs: tuple[tuple[str, float], ...] = ()


_FRICTION: tuple[Effect, ...] = (
    Effect("coulomb", "N", "load", "dry friction while sliding", 0.4, dry=True),
    Effect("static_ratio", "1", "load", "static over sliding dry friction", 2.0, 1.0, low=1.0,
           dry=True, needs=(("coulomb", 0.86),)),
    Effect("stiction", "N", "load", "extra force to break away from rest", 4.0, dry=True,
           needs=(("coulomb", 0.4),)),
    Effect("stribeck", "N", "load", "extra dry friction that fades with speed", 0.4, dry=True),
    Effect("stribeck_speed", "m/s", "load", "speed at which 37 % are left", 0.2, 0.05, low=1e-4,
           dry=True, needs=(("stribeck", 0.4),)),
    Effect("coulomb_direction", "N", "load", "more of it outwards, less inwards", 0.3, low=ANY,
           dry=True, needs=(("coulomb", 0.4),)),
    Effect("binding", "N/m", "load", "grows with distance from centre", 60.0, dry=True),
)  # fmt: skip

_FORCES: tuple[Effect, ...] = (
    Effect("viscous", "N s/m", "load", "force against velocity", 2.0),
    Effect("quadratic_drag", "N s^2/m^2", "load", "force against velocity squared", 10.0),
    Effect("spring", "N/m", "load", "spring to mid stroke", 150.0, low=-1e5, high=1e5),
    Effect("cubic_spring", "N/m^3", "load", "hardening spring to mid stroke", 2.0e6, high=1e8),
    Effect("constant_force", "N", "load", "surface out of level", 0.2, low=ANY),
    Effect("periodic_force", "N", "load", "shaking from a machine nearby", 0.5),
    Effect("periodic_frequency", "Hz", "load", "of that shaking", 5.0, 11.0,
           needs=(("periodic_force", 0.5),)),
    Effect("added_mass", "kg", "load", "something lies on the mass", 0.08, low=-0.2),
    Effect("backlash", "m", "piston", "play between rod and mass", 1.0e-3),
)  # fmt: skip

_ACTUATOR: tuple[Effect, ...] = (
    Effect("actuator_gain", "1", "actuator", "factor on the valve's voltage", 0.8, 1.0, low=ANY),
    Effect("actuator_offset", "V", "actuator", "valve's null has moved", 0.08, low=ANY),
    Effect("actuator_deadband", "V", "actuator", "half width in which the valve stays", 0.2),
    Effect("actuator_saturation", "V", "actuator", "limit of the valve's voltage", 0.9, 5.0),
    Effect("actuator_rate_limit", "V/s", "actuator", "limit of its rate", 40.0, 1.0e6),
    Effect("actuator_lag", "s", "actuator", "slow valve, time constant", 0.01),
    Effect("actuator_delay", "s", "actuator", "late valve", 0.012, high=LONGEST_DELAY),
)  # fmt: skip

_PNEUMATICS: tuple[Effect, ...] = (
    Effect("supply_drop", "1", "pneumatics", "lost share of the supply", 0.2, high=1.0),
    Effect("chamber_leak", "mm^2", "pneumatics", "hole in the piston's seal", 0.02),
    Effect("leak_1", "mm^2", "pneumatics", "hole from chamber 1 to the room", 0.01),
    Effect("leak_2", "mm^2", "pneumatics", "hole from chamber 2 to the room", 0.01),
    Effect("port_blockage", "1", "pneumatics", "blocked share of both lines", 0.4, high=0.99),
)  # fmt: skip

DYNAMIC = _FRICTION + _FORCES + _ACTUATOR + _PNEUMATICS

CHANNELS: tuple[Literal["voltage", "position", "acceleration"], ...] = (
    "voltage",
    "position",
    "acceleration",
)


@dataclass(frozen=True, slots=True)
class SensorFault:
    """A fault that each channel can have; `typical` for voltage [V], position [m], acceleration."""

    name: str
    unit: str
    does: str
    typical: tuple[float, float, float]
    neutral: float = 0.0
    low: float = 0.0
    high: float = np.inf


SENSOR_FAULTS: tuple[SensorFault, ...] = (
    SensorFault("gain", "1", "factor on the reading", (0.8, 0.8, 0.8), 1.0, low=ANY),
    SensorFault("bias", "SI", "added to the reading", (0.3, 3.0e-3, 2.0), low=ANY),
    SensorFault(
        "drift", "SI/s", "bias that grows from when it is set", (0.02, 2.0e-4, 0.2), low=ANY
    ),
    SensorFault("lag", "s", "time constant of the reading", (0.01, 0.01, 0.01)),
    SensorFault("delay", "s", "lateness of the reading", (0.012, 0.012, 0.012), high=LONGEST_DELAY),
    SensorFault("noise", "SI", "rms of added noise", (0.1, 5.0e-4, 1.0)),
    SensorFault("stuck", "0 or 1", "the reading is frozen", (1.0, 1.0, 1.0), high=1.0),
    SensorFault("saturation", "SI", "limit of the reading, 0 for none", (0.8, 3.0e-3, 8.0)),
    SensorFault("spikes", "SI", "height of spikes, two a second", (2.0, 8.0e-3, 60.0), low=ANY),
)

_UNITS = {"voltage": "V", "position": "m", "acceleration": "m/s^2"}


def _on_channel(
    fault: SensorFault, place: Literal["voltage", "position", "acceleration"]
) -> Effect:
    return Effect(
        f"{place}_{fault.name}",
        fault.unit.replace("SI", _UNITS[place]),
        place,
        f"{place} sensor: {fault.does}",
        fault.typical[CHANNELS.index(place)],
        fault.neutral,
        fault.low,
        fault.high,
    )


SENSOR = tuple(_on_channel(fault, channel) for channel in CHANNELS for fault in SENSOR_FAULTS)

EFFECTS: dict[str, Effect] = {effect.name: effect for effect in DYNAMIC + SENSOR}
"""Every effect by its name."""


def complaint(name: str, value: float) -> tuple[str, str] | None:
    """The found and the expected value if an effect cannot have this value, else None."""
    if name not in EFFECTS:
        near = difflib.get_close_matches(name, EFFECTS, 1)
        return repr(name), f"{near[0]!r}?" if near else f"one of {', '.join(EFFECTS)}"
    effect = EFFECTS[name]
    if np.isfinite(value) and effect.low <= value <= effect.high:
        return None
    return f"{value:g}", f"a finite number from {effect.low:g} to {effect.high:g} {effect.unit}"


DYNAMIC_TYPE = np.dtype([(effect.name, np.float64) for effect in DYNAMIC])
SENSOR_TYPE = np.dtype([(fault.name, np.float64) for fault in SENSOR_FAULTS])


def neutral_dynamic() -> NDArray[np.void]:
    """The dynamic effects, all absent, as one record; shape (1,)."""
    return np.array([tuple(effect.neutral for effect in DYNAMIC)], dtype=DYNAMIC_TYPE)


def neutral_sensor() -> NDArray[np.void]:
    """The sensor faults, all absent, one record a channel; shape (3,)."""
    return np.array([tuple(fault.neutral for fault in SENSOR_FAULTS)] * 3, dtype=SENSOR_TYPE)
