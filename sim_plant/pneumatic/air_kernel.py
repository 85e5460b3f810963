"""The air of the rig: flows through passages, chambers, and the pressures that balance at rest.

See `plant_kernel.py` for equations and symbols.
"""

# Fields of a record are known to numba, not to mypy.
# mypy: disable-error-code="no-any-return"

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.kernel import kernel, part

Record = Any
"""One record of a structured array; numba compiles its fields as attributes."""
_GAS = 287.05


@part(error_model="numpy")
def orifice(area_mm2: float, p: Record) -> float:
    """Conductance c of an orifice of `area_mm2` [m^3/s]."""
    n = p.heat_capacity_ratio
    psi = math.sqrt(n * (2.0 / (n + 1.0)) ** ((n + 1.0) / (n - 1.0)))
    return 2.0e-6 * psi * p.discharge * area_mm2 * math.sqrt(_GAS * p.temperature)


@part(error_model="numpy")
def flow(pressure_a: float, pressure_b: float, conductance: float, resistance: float) -> float:
    """Flow from a to b through an orifice behind a laminar resistance [Pa m^3/s]."""
    upstream = max(pressure_a, pressure_b)
    downstream = max(min(pressure_a, pressure_b), 0.5 * upstream)
    square = conductance * conductance * downstream
    linear = 2.0 * resistance * square / (upstream + downstream)
    drop = 4.0 * square * (upstream - downstream)
    amount = 0.5 * (math.sqrt(linear * linear + drop) - linear)
    return amount if pressure_a > pressure_b else -amount


@part(error_model="numpy")
def upstream(lift: float, supply: float, p: Record) -> float:
    """Pressure at a nozzle that the flapper lifts by `lift`, with a share of the supply [Pa]."""
    pressure = min(max(p.mean_pressure + lift, p.atmosphere), p.highest_pressure)
    return p.atmosphere + supply * (pressure - p.atmosphere)


class Passages(NamedTuple):
    """Conductances of the orifices [m^3/s], and the ports' laminar resistance [Pa s/m^3]."""

    port: float
    port_resistance: float
    piston: float
    outward_1: float
    outward_2: float


@part(error_model="numpy")
def passages(p: Record, e: Record) -> Passages:
    """The passages of the air with their blockage and leaks."""
    clear = 1.0 - e.port_blockage
    return Passages(
        orifice(p.port_area, p) * clear,
        p.port_resistance / clear**2,
        orifice(p.piston_leak + e.chamber_leak, p),
        orifice(e.leak_1, p),
        orifice(e.leak_2, p),
    )


@part(error_model="numpy")
def chambers(  # noqa: PLR0917
    p1: float, p2: float, pu1: float, pu2: float, x: float, v: float, h: float,
    ways: Passages, p: Record,
) -> tuple[float, float]:  # fmt: skip
    """Pressures of the chambers after a step of h [s] that ends at x with velocity v [Pa]."""
    hn = h * p.heat_capacity_ratio
    across = flow(p1, p2, ways.piston, p.leak_resistance)
    into_1 = flow(pu1, p1, ways.port, ways.port_resistance) - across
    into_2 = flow(pu2, p2, ways.port, ways.port_resistance) + across
    if ways.outward_1 > 0.0:
        into_1 -= flow(p1, p.atmosphere, ways.outward_1, p.leak_resistance)
    if ways.outward_2 > 0.0:
        into_2 -= flow(p2, p.atmosphere, ways.outward_2, p.leak_resistance)
    half, middle = 0.5 * p.stroke, x - 0.5 * h * v
    volume_1 = p.dead_volume + p.piston_area * max(half + middle, 0.0)
    volume_2 = p.dead_volume + p.annulus_area * max(half - middle, 0.0)
    swept_1, swept_2 = 0.5 * hn * p.piston_area * v, -0.5 * hn * p.annulus_area * v
    return (
        (p1 * (volume_1 - swept_1) + hn * into_1) / (volume_1 + swept_1),
        (p2 * (volume_2 - swept_2) + hn * into_2) / (volume_2 + swept_2),
    )


@part(error_model="numpy")
def _upstream(pressure: float, wanted: float, port: float, p: Record) -> float:
    """Upstream pressure that drives the flow `wanted` into a chamber at `pressure` [Pa]."""
    found = pressure
    for _ in range(100):
        downstream = pressure if wanted > 0.0 else found
        drop = abs(wanted) * p.port_resistance * 2.0 / (pressure + found)
        drop += (wanted / port) ** 2 / downstream
        found = pressure + math.copysign(drop, wanted)
    return found


@kernel(error_model="numpy")
def balance(parameters: NDArray[np.void]) -> tuple[float, float, float]:
    """Pressures at which the piston rests at mid stroke, and the valve's null that gives them.

    Chamber 1 has more area than chamber 2, so with equal pressures the rod creeps out. As on a real
    valve, a one-time null adjustment makes 0 V hold the healthy piston still.

    Returns:
        P1, P2 and the null pressure [Pa].
    """
    p: Record = parameters[0]
    port, leak = orifice(p.port_area, p), orifice(p.piston_leak, p)
    low, high = p.atmosphere, p.highest_pressure
    for _ in range(100):
        p1 = 0.5 * (low + high)
        p2 = (p1 * p.piston_area - p.atmosphere * (p.piston_area - p.annulus_area)) / p.annulus_area
        across = flow(p1, p2, leak, p.leak_resistance)
        pu1 = _upstream(p1, across, port, p)
        pu2 = _upstream(p2, -across, port, p)
        low, high = (p1, high) if pu1 + pu2 < 2.0 * p.mean_pressure else (low, p1)
    return p1, p2, 0.5 * (pu1 - pu2)
