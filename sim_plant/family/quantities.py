"""Draws the quantities of a member, in SI units, for the laws that its flavour fixes."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim_plant.family.flavours import Flavour
from sim_plant.family.kernel import LAWS, QUANTITIES, SUBSTEPS, flow
from sim_plant.family.laws import Friction, Heat, Stage

Random = np.random.Generator
ROOM_PRESSURE, ROOM_TEMPERATURE = 101.3e3, 294.0
"""[Pa], [K]"""
INCH = 0.0254
"""[m]"""
_PISTON_SPEED = 0.25


def body(kind: Flavour, random: Random) -> dict[str, float]:
    """Mass, cylinder, centring by hoses, viscous friction."""
    area = random.uniform(5.8e-5, 7.5e-5)
    return {
        "mass": random.uniform(0.20, 0.28),
        "area_1": area,
        # A bridge has no null to trim two areas with, so its cylinder has a rod on both sides.
        "area_2": area * (1.0 if kind.stage is Stage.BRIDGE else random.uniform(0.93, 0.98)),
        "half_stroke": 0.5 * random.uniform(4.5, 5.5) * INCH,
        "centring": random.uniform(20.0, 45.0),
        "viscous": random.uniform(0.05, 0.4),
    }


def gas(kind: Flavour, random: Random) -> dict[str, float]:
    """Pressures, dead volumes, heat of the gas, laws of flow."""
    supply = random.uniform(250e3, 400e3)
    return {
        "supply": supply,
        "middle": supply * random.uniform(0.72, 0.85),
        "ambient": ROOM_PRESSURE,
        "temperature": ROOM_TEMPERATURE,
        "dead_1": random.uniform(0.5e-6, 1.5e-6),
        "dead_2": random.uniform(0.5e-6, 1.5e-6),
        "flow": kind.flow,
        "heat": kind.heat,
        "stage": kind.stage,
        "exponent": random.uniform(1.08, 1.35),
        # Wall of some 0.002 m^2 at 20 to 100 W/(m^2 K).
        "wall": random.uniform(0.04, 0.2) if kind.heat is Heat.ENERGY else 0.0,
        "critical_ratio": random.uniform(0.2, 0.45),
        "laminar": random.uniform(0.004, 0.015),
    }


def valve(kind: Flavour, random: Random) -> dict[str, float]:
    """Speed and small faults of a healthy valve; its gain and null are trimmed later."""
    return {
        "valve_rate": 2 * np.pi * random.uniform(20.0, 80.0),
        "valve_damping": random.uniform(0.7, 1.1) if kind.second_order_valve else 0.0,
        "valve_gain": 0.1 if kind.stage is Stage.BRIDGE else 2.0e4,
        "valve_null": 0.0,
        "asymmetry": random.uniform(0.01, 0.04) if kind.asymmetry else 0.0,
        "hysteresis": random.uniform(0.005, 0.02) if kind.play else 0.0,
        "slew": random.uniform(150.0, 300.0) if kind.slew else 1e6,
    }


def friction(kind: Flavour, random: Random) -> dict[str, float]:
    """Dry friction of the healthy rig, and the shape of that added as a fault."""
    own = Friction.TANH if kind.own is None else kind.own
    level = random.uniform(0.02, 0.08)
    return {
        "own_friction": own,
        "own_level": 0.0 if kind.own is None else level,
        "added_friction": kind.added,
        "static_ratio": random.uniform(1.05, 1.5),
        "stribeck_speed": random.uniform(0.005, 0.04),
        "bristle": random.uniform(4e-5, 1e-4),
        "bristle_damping": random.uniform(0.0, 2e-4),
        "smooth_speed": random.uniform(1e-3, 4e-3),
    }


def sensors(kind: Flavour, random: Random) -> dict[str, float]:
    """Lags, AC coupling, resolution and zero of LVDT and accelerometer."""
    corners = 2 * np.pi * random.uniform(0.1, 1.0, 2)
    return {
        "lvdt_rate": 2 * np.pi * random.uniform(150.0, 500.0),
        "lvdt_step": 0.1016 / 2**16 if kind.fine_position else 0.001 * INCH,
        "lvdt_offset": random.uniform(-3e-4, 3e-4),
        "high_pass_1": corners[0],
        "high_pass_2": corners[1] if kind.high_passes == 2 else 0.0,
        "amplifier_rate": 2 * np.pi * random.uniform(100.0, 400.0),
    }


PARTS: tuple[Callable[[Flavour, Random], dict[str, float]], ...] = (
    body,
    gas,
    valve,
    friction,
    sensors,
)


def set_restrictions(record: NDArray[np.void], random: Random) -> None:
    """Conductances at which a piston at 0.25 m/s makes the pressure drops drawn, and the leak."""
    p = {name: record[name][0] for name in (*LAWS, *QUANTITIES)}

    def unit(a: float, b: float) -> float:
        return float(flow(p["flow"], a, b, 1.0, p["critical_ratio"], p["laminar"]))

    middle, ratio = float(p["middle"]), 0.0
    if p["stage"] == Stage.BRIDGE:
        ratio = unit(p["supply"], middle) / unit(middle, ROOM_PRESSURE)
    for side in (1, 2):
        drop = random.uniform(2.5e3, 1.1e4)
        through = unit(middle + drop, middle)
        if ratio:
            through = unit(p["supply"], middle - drop) - ratio * unit(middle - drop, ROOM_PRESSURE)
        swept = middle * float(p[f"area_{side}"]) * _PISTON_SPEED
        record[f"conductance_{side}"] = swept / through
    record["nozzle_ratio"] = ratio
    record["leak"] = random.uniform(0.0, 0.03) * swept / drop
    if p["stage"] == Stage.REGULATED:
        _set_regulator(record, random, swept / unit(p["supply"], middle), swept)


def _set_regulator(record: NDArray[np.void], random: Random, whole: float, swept: float) -> None:
    """Outlets, flow and controller of pressure regulators.

    Args:
        record: of the member.
        random: source of what is drawn.
        whole: conductance through which the supply feeds a piston at 0.25 m/s [m^3/s].
        swept: that flow, times R T0 [Pa m^3/s].
    """
    outlet, larger = random.uniform(1.5e-6, 4e-6), random.uniform(4.0, 8.0)
    bandwidth = 2 * np.pi * random.uniform(15.0, 40.0)
    record["outlet"], record["regulator_flow"] = outlet, larger * whole
    record["regulator_gain"] = bandwidth * outlet / (larger * swept)
    record["regulator_reset"] = record["regulator_gain"] * bandwidth / random.uniform(3.0, 8.0)


def lateness(kind: Flavour, random: Random) -> tuple[int, int]:
    """Steps after the voltage's at which position and acceleration are sampled."""
    if not kind.late:
        return 0, 0
    steps = int(random.integers(SUBSTEPS // 8, SUBSTEPS // 3))
    return (steps, 0) if random.random() < 0.5 else (0, steps)


def clock(kind: Flavour, random: Random) -> float:
    """Share by which the free generator runs fast or slow."""
    size = random.uniform(0.008, 0.02) if kind.mistuned else random.uniform(0.001, 0.006)
    return float(size if random.random() < 0.5 else -size)
