"""The rig's motion, stepped on a fixed fine grid: valve, chambers, piston, load, dry friction.

    w(Pa, Pb) : Pu - Pd = w r / ((Pu + Pd) / 2) + w^2 / (c^2 Pd),   signed from a to b
    V1 dP1/dt = n ( w(Pu1, P1) - w(P1, P2) - w(P1, Pe) - P1 A1 v ),   V1 = Vd + A1 (L/2 + x)
    V2 dP2/dt = n ( w(Pu2, P2) + w(P1, P2) - w(P2, Pe) + P2 A2 v ),   V2 = Vd + A2 (L/2 - x)
    m dv/dt   = P1 A1 - P2 A2 - Pe (A1 - A2) + other forces - dry friction
    Pu1, Pu2  = Pm +- (null + slope u),   u = voltage through two lags (heavily damped 2nd order)

Symbols: P absolute pressure [Pa], Pu upstream, Pd downstream but not below Pu/2 (choked), Pm mean,
Pe of the room [Pa], w flow times R T [Pa m^3/s], c = 2 psi2 Cd a sqrt(R T) [m^3/s] for an orifice
of area a, r laminar resistance to volume flow [Pa s/m^3], n ratio of heat capacities [1], A areas
[m^2], V volumes, Vd dead volume [m^3], L stroke [m], x from mid stroke [m], m mass [kg].

The flow is that of (5.14), docs/theory.md 1.1, behind a laminar passage, solved in closed form: a
fast flow follows (5.14), and near Pu = Pd it is linear, which removes the infinite slope. Steps are
semi-implicit (velocity, then position, then pressure, so that the air spring conserves energy). Dry
friction is implicit: an impulse of at most level times step that cannot reverse the velocity, so
the mass sticks exactly at any level.
"""

# Fields of a record are known to numba, not to mypy.
# mypy: disable-error-code="no-any-return"

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.kernel import kernel

Record = Any
"""One record of a structured array; numba compiles its fields as attributes."""
Floats = NDArray[np.float64]

TRUTH = ("x", "v", "a", "P1", "P2", "Pu1", "Pu2", "friction", "voltage", "sensed_a")
"""Columns of the true values, in SI units; `friction` is dry, on the load, positive against +x."""

STATE = (
    "x", "v", "a", "load_x", "load_v", "P1", "P2", "valve_1", "valve_2", "pick_off", "friction",
    "sensed_a", "lagged_volts", "limited_volts", "time", "apart",
)  # fmt: skip
STATE_TYPE = np.dtype([(name, np.float64) for name in STATE])
DELAY_LINE = 128
"""Voltage samples stored for a delayed valve."""

_GAS = 287.05
_GAP_STIFFNESS = 5.0e4
_GAP_DAMPING = 10.0


@kernel(error_model="numpy")
def orifice(area_mm2: float, p: Record) -> float:
    """Conductance c of an orifice of `area_mm2` [m^3/s]."""
    n = p.heat_capacity_ratio
    psi = math.sqrt(n * (2.0 / (n + 1.0)) ** ((n + 1.0) / (n - 1.0)))
    return 2.0e-6 * psi * p.discharge * area_mm2 * math.sqrt(_GAS * p.temperature)


@kernel(error_model="numpy")
def flow(pressure_a: float, pressure_b: float, conductance: float, resistance: float) -> float:
    """Flow from a to b through an orifice behind a laminar resistance [Pa m^3/s]."""
    upstream = max(pressure_a, pressure_b)
    downstream = max(min(pressure_a, pressure_b), 0.5 * upstream)
    square = conductance * conductance * downstream
    linear = 2.0 * resistance * square / (upstream + downstream)
    drop = 4.0 * square * (upstream - downstream)
    amount = 0.5 * (math.sqrt(linear * linear + drop) - linear)
    return amount if pressure_a > pressure_b else -amount


@kernel(error_model="numpy")
def dry_friction(  # noqa: PLR0917
    free_velocity: float,
    velocity: float,
    x: float,
    per_mass: float,
    base: float,
    e: Record,
) -> float:
    """Velocity after one step of dry friction [m/s].

    `free_velocity` is the velocity after the step without friction. A load at rest, or one that
    comes to rest within the step, stays unless the other forces exceed the static level; a sliding
    one is slowed by the kinetic level, which cannot reverse it.
    """
    toward = 1.0 if free_velocity > 0.0 else -1.0
    kinetic = base + e.coulomb + e.binding * abs(x) + e.coulomb_direction * toward
    kinetic = max(kinetic, 0.0)
    if velocity * free_velocity <= 0.0:
        static = e.static_ratio * kinetic + e.stribeck + e.stiction
        if abs(free_velocity - velocity) <= static * per_mass:
            return 0.0
    if e.stribeck > 0.0:
        kinetic += e.stribeck * math.exp(-((velocity / e.stribeck_speed) ** 2))
    return toward * max(abs(free_velocity) - kinetic * per_mass, 0.0)


@kernel(error_model="numpy")
def end_stop(x: float, v: float, p: Record) -> float:
    """Force of the end stops on the piston [N]: stiff, dissipative, never pulling."""
    over = abs(x) - 0.5 * p.stroke
    if over <= 0.0:
        return 0.0
    outward = v if x > 0.0 else -v
    force = max(p.stop_stiffness * over + p.stop_damping * outward, 0.0)
    return -force if x > 0.0 else force


@kernel(error_model="numpy")
def contact(offset: float, closing: float, gap: float) -> float:
    """Force of the rod on the load across play of width `gap` [N]; `offset` is rod less load."""
    over = abs(offset) - 0.5 * gap
    if over <= 0.0:
        return 0.0
    toward = 1.0 if offset > 0.0 else -1.0
    return toward * max(_GAP_STIFFNESS * over + _GAP_DAMPING * closing * toward, 0.0)


@kernel(error_model="numpy")
def other_forces(x: float, time: float, e: Record) -> float:
    """Hidden forces on the load that are neither dry nor proportional to velocity [N]."""
    force = e.constant_force - e.spring * x - e.cubic_spring * x**3
    if e.periodic_force != 0.0:
        force += e.periodic_force * math.sin(2.0 * math.pi * e.periodic_frequency * time)
    return force


@kernel(error_model="numpy")
def valve_voltage(line: Floats, sample: int, s: Record, e: Record, p: Record) -> float:
    """The drive voltage at the flapper, after the actuator's faults [V]."""
    late = min(e.actuator_delay * p.sample_rate, DELAY_LINE - 2.0)
    whole = int(late)
    part = late - whole
    volts = (1.0 - part) * line[(sample - whole) % DELAY_LINE]
    volts += part * line[(sample - whole - 1) % DELAY_LINE]
    volts = e.actuator_gain * volts + e.actuator_offset
    volts = math.copysign(max(abs(volts) - e.actuator_deadband, 0.0), volts)
    if e.actuator_lag > 0.0:
        share = 1.0 - math.exp(-1.0 / (e.actuator_lag * p.sample_rate))
        volts = s.lagged_volts + share * (volts - s.lagged_volts)
    s.lagged_volts = volts
    step = e.actuator_rate_limit / p.sample_rate
    volts = s.limited_volts + min(max(volts - s.limited_volts, -step), step)
    s.limited_volts = volts
    limit = min(e.actuator_saturation, p.valve_limit)
    return min(max(volts, -limit), limit)


@kernel(error_model="numpy")
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


@kernel(error_model="numpy")
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


@kernel(error_model="numpy")
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


@kernel(error_model="numpy")
def couple(s: Record, load: float, rigid: bool, p: Record) -> None:
    """Piston and load as one mass from now on, which keeps their momentum, or as two."""
    if rigid:
        if s.apart > 0.0:
            s.v = (p.piston_mass * s.v + load * s.load_v) / (p.piston_mass + load)
            s.x = s.load_x
        s.load_x, s.load_v = s.x, s.v
    s.apart = 0.0 if rigid else 1.0


@kernel(error_model="numpy")
def advance_plant(  # noqa: PLR0915, PLR0917
    command: Floats,
    parameters: NDArray[np.void],
    effects: NDArray[np.void],
    null: float,
    state: NDArray[np.void],
    line: Floats,
    first: int,
    truth: Floats,
) -> None:
    """Advances `state` by `len(command)` samples and writes one row of `TRUTH` for each.

    A sample is read just after its voltage is applied, which is then held. `first` is
    the number of the first sample, `null` the offset pressure of the valve's null [Pa].
    """
    p: Record = parameters[0]
    e: Record = effects[0]
    s: Record = state[0]
    h = 1.0 / (p.sample_rate * p.substeps)
    area_1, area_2 = p.piston_area, p.annulus_area
    ways, supply = passages(p, e), 1.0 - e.supply_drop
    spread = math.sqrt(p.valve_damping**2 - 1.0)
    valve = 2.0 * math.pi * p.valve_frequency
    share_1 = 1.0 - math.exp(-h * valve * (p.valve_damping - spread))
    share_2 = 1.0 - math.exp(-h * valve * (p.valve_damping + spread))
    share_a = 1.0 - math.exp(-h * 2.0 * math.pi * p.accelerometer_bandwidth)
    share_c = 1.0 - math.exp(-2.0 * math.pi * p.centring_frequency / p.sample_rate)
    load = p.load_mass + e.added_mass
    rigid = e.backlash <= 0.0
    per_mass = h / (load + p.piston_mass if rigid else load)
    viscous = e.viscous + (p.piston_viscous if rigid else 0.0)
    braked = 1.0 / (1.0 + per_mass * viscous)
    steps_per_second = p.sample_rate * p.substeps
    couple(s, load, rigid, p)
    x, v, load_x, load_v, a = s.x, s.v, s.load_x, s.load_v, s.a
    p1, p2, valve_1, valve_2 = s.P1, s.P2, s.valve_1, s.valve_2
    friction, sensed = s.friction, s.sensed_a
    for row in range(command.size):
        sample = first + row
        s.pick_off += share_c * (load_x - s.pick_off)
        drive = command[row] - p.centring_gain * s.pick_off
        drive = min(max(drive, -p.valve_limit), p.valve_limit)
        line[sample % DELAY_LINE] = drive
        volts = valve_voltage(line, sample, s, e, p)
        lift = null + p.pressure_per_volt * valve_2
        pu1, pu2 = upstream(lift, supply, p), upstream(-lift, supply, p)
        truth[row, 0], truth[row, 1], truth[row, 2] = load_x, load_v, a
        truth[row, 3], truth[row, 4], truth[row, 5], truth[row, 6] = p1, p2, pu1, pu2
        truth[row, 7], truth[row, 8], truth[row, 9] = friction, drive, sensed
        for sub in range(int(p.substeps)):
            # Means over the step, so that the valve neither leads nor lags.
            former_1, former_2 = valve_1, valve_2
            valve_1 += share_1 * (volts - valve_1)
            valve_2 += share_2 * (0.5 * (former_1 + valve_1) - valve_2)
            lift = null + 0.5 * p.pressure_per_volt * (former_2 + valve_2)
            pu1, pu2 = upstream(lift, supply, p), upstream(-lift, supply, p)

            push = p1 * area_1 - p2 * area_2 - p.atmosphere * (area_1 - area_2)
            push += end_stop(x, v, p)
            force = other_forces(load_x, (sample + sub / p.substeps) / p.sample_rate, e)
            if rigid:
                force += push
            else:
                joint = contact(x - load_x, v - load_v, e.backlash)
                v += h * (push - joint) / p.piston_mass
                v /= 1.0 + h * p.piston_viscous / p.piston_mass
                force += joint
            if e.quadratic_drag != 0.0:
                braked = 1.0 / (1.0 + per_mass * (viscous + e.quadratic_drag * abs(load_v)))
            free = (load_v + per_mass * force) * braked
            slid = dry_friction(free, load_v, load_x, per_mass, p.piston_coulomb, e)
            friction = (free - slid) / per_mass
            a = (slid - load_v) * steps_per_second
            load_v = slid
            load_x += h * load_v
            sensed += share_a * (a - sensed)
            if rigid:
                x, v = load_x, load_v
            else:
                x += h * v

            p1, p2 = chambers(p1, p2, pu1, pu2, x, v, h, ways, p)
    s.x, s.v, s.load_x, s.load_v, s.a = x, v, load_x, load_v, a
    s.P1, s.P2, s.valve_1, s.valve_2 = p1, p2, valve_1, valve_2
    s.friction, s.sensed_a = friction, sensed


@kernel(error_model="numpy")
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
