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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.kernel import kernel, part
from sim_plant.pneumatic.air_kernel import Record, chambers, passages, upstream

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

_GAP_STIFFNESS = 5.0e4
_GAP_DAMPING = 10.0


@part(error_model="numpy")
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


@part(error_model="numpy")
def end_stop(x: float, v: float, p: Record) -> float:
    """Force of the end stops on the piston [N]: stiff, dissipative, never pulling."""
    over = abs(x) - 0.5 * p.stroke
    if over <= 0.0:
        return 0.0
    outward = v if x > 0.0 else -v
    force = max(p.stop_stiffness * over + p.stop_damping * outward, 0.0)
    return -force if x > 0.0 else force


@part(error_model="numpy")
def contact(offset: float, closing: float, gap: float) -> float:
    """Force of the rod on the load across play of width `gap` [N]; `offset` is rod less load."""
    over = abs(offset) - 0.5 * gap
    if over <= 0.0:
        return 0.0
    toward = 1.0 if offset > 0.0 else -1.0
    return toward * max(_GAP_STIFFNESS * over + _GAP_DAMPING * closing * toward, 0.0)


@part(error_model="numpy")
def other_forces(x: float, time: float, e: Record) -> float:
    """Hidden forces on the load that are neither dry nor proportional to velocity [N]."""
    force = e.constant_force - e.spring * x - e.cubic_spring * x**3
    if e.periodic_force != 0.0:
        force += e.periodic_force * math.sin(2.0 * math.pi * e.periodic_frequency * time)
    return force


@part(error_model="numpy")
def valve_voltage(line: Floats, sample: int, s: Record, e: Record, p: Record) -> float:
    """The drive voltage at the flapper, after the actuator's faults [V]."""
    late = min(e.actuator_delay * p.sample_rate, DELAY_LINE - 2.0)
    whole = int(late)
    rest = late - whole
    volts = (1.0 - rest) * line[(sample - whole) % DELAY_LINE]
    volts += rest * line[(sample - whole - 1) % DELAY_LINE]
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


@part(error_model="numpy")
def couple(s: Record, load: float, rigid: bool, p: Record) -> None:
    """Piston and load as one mass from now on, which keeps their momentum, or as two."""
    if rigid:
        if s.apart > 0.0:
            s.v = (p.piston_mass * s.v + load * s.load_v) / (p.piston_mass + load)
            s.x = s.load_x
        s.load_x, s.load_v = s.x, s.v
    s.apart = 0.0 if rigid else 1.0


class Steps(NamedTuple):
    """What stays the same while the rig is advanced.

    Args:
        h: length of a step [s].
        per_second: number of steps per second.
        first, second: shares by which the valve's two lags follow their inputs in a step.
        sensed: the same of the accelerometer.
        centring: the same of the centring loop's pick-off, in a sample.
        rigid: whether piston and load are one mass.
        per_mass: h over the mass that carries the load's friction [s/kg].
        viscous: viscous friction on that mass [N s/m].
    """

    h: float
    per_second: float
    first: float
    second: float
    sensed: float
    centring: float
    rigid: bool
    per_mass: float
    viscous: float


@part(error_model="numpy")
def steps_of(load: float, p: Record, e: Record) -> Steps:
    """The steps of a rig with this moving mass [kg]."""
    h = 1.0 / (p.sample_rate * p.substeps)
    spread = math.sqrt(p.valve_damping**2 - 1.0)
    valve = 2.0 * math.pi * p.valve_frequency
    rigid = e.backlash <= 0.0
    return Steps(
        h,
        p.sample_rate * p.substeps,
        1.0 - math.exp(-h * valve * (p.valve_damping - spread)),
        1.0 - math.exp(-h * valve * (p.valve_damping + spread)),
        1.0 - math.exp(-h * 2.0 * math.pi * p.accelerometer_bandwidth),
        1.0 - math.exp(-2.0 * math.pi * p.centring_frequency / p.sample_rate),
        rigid,
        h / (load + p.piston_mass if rigid else load),
        e.viscous + (p.piston_viscous if rigid else 0.0),
    )


class Motion(NamedTuple):
    """Piston and load: positions, velocities, and of the load acceleration and dry friction."""

    x: float
    v: float
    load_x: float
    load_v: float
    a: float
    friction: float


@part(error_model="numpy")
def moved(m: Motion, push: float, time: float, c: Steps, p: Record, e: Record) -> Motion:  # noqa: PLR0917
    """The motion after a step in which the air pushes the piston with a force `push` [N]."""
    x, v, load_x, load_v, _, _ = m
    push += end_stop(x, v, p)
    force = other_forces(load_x, time, e)
    if c.rigid:
        force += push
    else:
        joint = contact(x - load_x, v - load_v, e.backlash)
        v += c.h * (push - joint) / p.piston_mass
        v /= 1.0 + c.h * p.piston_viscous / p.piston_mass
        force += joint
    viscous = c.viscous
    if e.quadratic_drag != 0.0:
        viscous += e.quadratic_drag * abs(load_v)
    free = (load_v + c.per_mass * force) * (1.0 / (1.0 + c.per_mass * viscous))
    slid = dry_friction(free, load_v, load_x, c.per_mass, p.piston_coulomb, e)
    friction, a = (free - slid) / c.per_mass, (slid - load_v) * c.per_second
    load_x += c.h * slid
    if c.rigid:
        return Motion(load_x, slid, load_x, slid, a, friction)
    return Motion(x + c.h * v, v, load_x, slid, a, friction)


@part(error_model="numpy")
def centred(command: float, place: float, s: Record, c: Steps, p: Record) -> float:
    """The voltage that the centring loop makes of a command, from the load's place [V]."""
    s.pick_off += c.centring * (place - s.pick_off)
    drive = command - p.centring_gain * s.pick_off
    return min(max(drive, -p.valve_limit), p.valve_limit)


@kernel(error_model="numpy")
def advance_plant(  # noqa: PLR0917
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
    load = p.load_mass + e.added_mass
    c, ways, supply = steps_of(load, p, e), passages(p, e), 1.0 - e.supply_drop
    area_1, area_2 = p.piston_area, p.annulus_area
    couple(s, load, c.rigid, p)
    m = Motion(s.x, s.v, s.load_x, s.load_v, s.a, s.friction)
    p1, p2, valve_1, valve_2, sensed = s.P1, s.P2, s.valve_1, s.valve_2, s.sensed_a
    for row in range(command.size):
        sample = first + row
        drive = centred(command[row], m.load_x, s, c, p)
        line[sample % DELAY_LINE] = drive
        volts = valve_voltage(line, sample, s, e, p)
        lift = null + p.pressure_per_volt * valve_2
        pu1, pu2 = upstream(lift, supply, p), upstream(-lift, supply, p)
        truth[row, 0], truth[row, 1], truth[row, 2] = m.load_x, m.load_v, m.a
        truth[row, 3], truth[row, 4], truth[row, 5], truth[row, 6] = p1, p2, pu1, pu2
        truth[row, 7], truth[row, 8], truth[row, 9] = m.friction, drive, sensed
        for sub in range(int(p.substeps)):
            # Means over the step, so that the valve neither leads nor lags.
            former_1, former_2 = valve_1, valve_2
            valve_1 += c.first * (volts - valve_1)
            valve_2 += c.second * (0.5 * (former_1 + valve_1) - valve_2)
            lift = null + 0.5 * p.pressure_per_volt * (former_2 + valve_2)
            pu1, pu2 = upstream(lift, supply, p), upstream(-lift, supply, p)
            push = p1 * area_1 - p2 * area_2 - p.atmosphere * (area_1 - area_2)
            m = moved(m, push, (sample + sub / p.substeps) / p.sample_rate, c, p, e)
            sensed += c.sensed * (m.a - sensed)
            p1, p2 = chambers(p1, p2, pu1, pu2, m.x, m.v, c.h, ways, p)
    s.x, s.v, s.load_x, s.load_v, s.a, s.friction = m
    s.P1, s.P2, s.valve_1, s.valve_2, s.sensed_a = p1, p2, valve_1, valve_2, sensed
