"""Motion, chambers, valve and sensors of one member, integrated by Runge-Kutta steps.

    V1 dP1/dt = n ( w1 - wl - P1 A1 v ),     V1 = Vd1 + A1 (L + x)
    V2 dP2/dt = n ( w2 + wl + P2 A2 v ),     V2 = Vd2 + A2 (L - x)
    m dv/dt   = (P1 - Pe) A1 - (P2 - Pe) A2 - k x - c v - dry friction + hidden forces

Symbols: P absolute pressure [Pa], w flow times R T0 [Pa m^3/s], wl leak across the piston, A areas
[m^2], L half the stroke [m], Vd dead volume [m^3], x from mid stroke [m], v velocity [m/s], m mass
[kg], k soft centring by hoses [N/m], c viscous friction [N s/m], Pe pressure of the room [Pa].

A pressure stage feeds each chamber through one restriction from Pm +- gain u; a bridge feeds it
from the supply through c (1 + u) and empties it through a nozzle r c (1 - u), and crosswise.
A regulated stage feeds each through one restriction from the outlet of a pressure regulator, whose
volume Vr a valve of limited flow fills or empties, opened by o of a PI controller:

    Vr dU/dt = wr(o) - w,     o = kp e + ki ∫e dt within ±1,     e = Pm +- gain u - U

Isothermal gas has n = 1, polytropic gas its own n. With the energy balance, gas that enters has the
room's temperature T0, gas that leaves has the chamber's T, and the wall returns h (T0 - T) [W]:

    V dP/dt = gamma R (q_in T0 - q_out T) - gamma P dV/dt + (gamma - 1) h (T0 - T)

Sensors: LVDT with one lag; accelerometer with one or two high-pass stages and the amplifier's lag.
"""

# Fields of a record are known to numba, not to mypy.
# mypy: disable-error-code="no-any-return"

# Everything that `simulate` calls is in this file: numba's cache ignores changes in others.

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigwatch.wire.kernel import kernel, part
from sim_plant.family.laws import Flow, Friction, Heat, Stage

Record = Any
"""One record of a structured array; numba compiles its fields as attributes."""
Floats = NDArray[np.float64]

SUBSTEPS = 48
"""Runge-Kutta steps in one sample."""
GAMMA = 1.4
X, V, P1, P2, T1, T2, S, S_RATE, Z_OWN, Z_ADDED, LVDT, HIGH_1, HIGH_2, AMPLIFIER = range(14)
U1, U2, OPEN_1, OPEN_2 = range(14, 18)
STATES = 18

LAWS = ("flow", "heat", "stage", "own_friction", "added_friction")
QUANTITIES = (
    "mass", "area_1", "area_2", "half_stroke", "dead_1", "dead_2", "supply", "middle", "ambient",
    "temperature", "conductance_1", "conductance_2", "nozzle_ratio", "critical_ratio", "laminar",
    "leak", "exponent", "wall", "valve_rate", "valve_damping", "valve_gain", "valve_null",
    "asymmetry", "hysteresis", "slew", "centring", "viscous", "own_level", "static_ratio",
    "stribeck_speed", "bristle", "bristle_damping", "smooth_speed", "lvdt_rate", "lvdt_step",
    "lvdt_offset", "high_pass_1", "high_pass_2", "amplifier_rate", "outlet", "regulator_flow",
    "regulator_gain", "regulator_reset",
)  # fmt: skip
MEMBER_TYPE = np.dtype([(n, np.int64) for n in LAWS] + [(n, np.float64) for n in QUANTITIES])
"""Laws and quantities of a member, in SI units; rates in rad/s."""

HIDDEN = {
    "dry": 0.0, "binding": 0.0, "spring": 0.0, "cubic": 0.0, "drag": 0.0, "mass": 0.0,
    "deadband": 0.0, "saturation": 1e3, "valve_gain": 1.0, "supply": 1.0, "middle": 1.0,
    "ripple": 0.0, "ripple_rate": 0.0, "accelerometer_lag": 0.0, "blockage": 0.0,
}  # fmt: skip
"""Hidden effects of the plant with the values at which they are absent."""
HIDDEN_TYPE = np.dtype([(name, np.float64) for name in HIDDEN])


def hidden_effects(values: dict[str, float]) -> NDArray[np.void]:
    """Two records: no effect, and effects of these values; shape (2,)."""
    hidden = np.array([tuple(HIDDEN.values())] * 2, dtype=HIDDEN_TYPE)
    for name, value in values.items():
        hidden[name][1] = value
    return hidden


ISO_6358, ORIFICE, WEYMOUTH = int(Flow.ISO_6358), int(Flow.ORIFICE), int(Flow.WEYMOUTH)
BLEND, ISENTROPIC = int(Flow.BLEND), int(Flow.ISENTROPIC)
POLYTROPIC, ENERGY = int(Heat.POLYTROPIC), int(Heat.ENERGY)
BRIDGE, REGULATED = int(Stage.BRIDGE), int(Stage.REGULATED)
TANH, KARNOPP, LUGRE = int(Friction.TANH), int(Friction.KARNOPP), int(Friction.LUGRE)
STRIBECK = int(Friction.STRIBECK)
_GAS = 287.05
_STOP_STIFFNESS, _STOP_DAMPING = 5.0e4, 60.0
_KARNOPP_SPEED, _KARNOPP_RATE = 1.5e-3, 1.0e3


@part(error_model="numpy")
def share_of_choked(law: int, r: float, critical: float) -> float:
    """Flow at the pressure ratio `r` (down over up) as a share of the choked flow."""
    if law == ISO_6358:
        over = max(r - critical, 0.0) / (1.0 - critical)
        return math.sqrt(1.0 - over * over)
    if law == ORIFICE:
        r = max(r, 0.5)
        return 2.0 * math.sqrt(r * (1.0 - r))
    r = max(r, 0.52828)
    return 3.8639 * math.sqrt(max(r ** (2.0 / GAMMA) - r ** ((GAMMA + 1.0) / GAMMA), 0.0))


@kernel(error_model="numpy")
def flow(  # noqa: PLR0917
    law: int, a: float, b: float, c: float, critical: float, laminar: float
) -> float:
    """Flow times R T0 from pressure `a` to `b` [Pa m^3/s] through a conductance `c` [m^3/s].

    `laminar` is the pressure drop, as a share of the upstream pressure, below which flow is
    laminar, which avoids the infinite slope at a = b.
    """
    up, down = max(a, b), max(min(a, b), 1.0)
    r = down / up
    if law == WEYMOUTH:
        square = 1.0 - r * r
        amount = c * up * square / (square * square + laminar * laminar) ** 0.25
    elif law == BLEND:
        # drop = R w + w^2 / (4 c^2 down), solved for w; R is that of the laminar share.
        held = 4.0 * c * c * max(down, 0.5 * up)
        resistance = held * math.sqrt(laminar * up / held)
        drop = min(up - down, 0.5 * up)
        amount = 0.5 * (math.sqrt(resistance * resistance + 4.0 * held * drop) - resistance)
    elif law in (ISO_6358, ORIFICE, ISENTROPIC):
        r = min(r, 1.0)
        edge = 1.0 - laminar
        if r > edge:
            amount = c * up * share_of_choked(law, edge, critical) * (1.0 - r) / laminar
        else:
            amount = c * up * share_of_choked(law, r, critical)
    else:
        # Poiseuille's flow of a gas, limited by the turbulent square-root law.
        square = 0.5 * (1.0 - r * r)
        poiseuille = c * up * square / math.sqrt(laminar)
        turbulent = c * up * math.sqrt(square) + 1e-30
        amount = poiseuille / math.sqrt(1.0 + (poiseuille / turbulent) ** 2)
    return amount if a > b else -amount


@part(error_model="numpy")
def dry_friction(  # noqa: PLR0917
    law: int, level: float, v: float, z: float, net: float, p: Record
) -> float:
    """Dry friction against +x [N] of a sliding level [N]; `z` is a bristle as a share of its reach.

    `net` is the sum of all other forces [N], which Karnopp's law holds at rest.
    """
    stribeck = 1.0 + (p.static_ratio - 1.0) * math.exp(-((v / p.stribeck_speed) ** 2))
    if law == KARNOPP:
        if abs(v) < _KARNOPP_SPEED:
            static = p.static_ratio * level
            held = net + p.mass * v * _KARNOPP_RATE
            return min(max(held, -static), static)
        return level if v > 0.0 else -level
    if law == TANH:
        return level * math.tanh(v / p.smooth_speed)
    if law == STRIBECK:
        return level * stribeck * math.tanh(v / p.smooth_speed)
    if law == LUGRE:
        return level * (z + p.bristle_damping * bristle_rate(law, v, z, p))
    return level * z


@part(error_model="numpy")
def bristle_rate(law: int, v: float, z: float, p: Record) -> float:
    """Rate of the bristle's share [1/s]: LuGre's with Stribeck's curve, else Dahl's."""
    reach = 1.0
    if law == LUGRE:
        reach += (p.static_ratio - 1.0) * math.exp(-((v / p.stribeck_speed) ** 2))
    return (v - abs(v) * z / reach) / p.bristle


@part(error_model="numpy")
def chamber_flows(y: Floats, p: Record, e: Record, time: float) -> tuple[float, float, float]:
    """Flows into chamber 1, into chamber 2 and across the piston, times R T0 [Pa m^3/s]."""
    factor = e.supply * (1.0 + e.ripple * math.sin(e.ripple_rate * time))
    law, b, lam = p.flow, p.critical_ratio, p.laminar
    c1, c2 = p.conductance_1 * (1.0 - e.blockage), p.conductance_2
    u = p.valve_gain * (y[S] + p.valve_null)
    if p.stage == BRIDGE:
        u = min(max(u, -0.95), 0.95)
        ps = p.supply * factor * e.middle
        w1 = flow(law, ps, y[P1], c1 * (1.0 + u), b, lam)
        w1 -= flow(law, y[P1], p.ambient, c1 * p.nozzle_ratio * (1.0 - u), b, lam)
        w2 = flow(law, ps, y[P2], c2 * (1.0 - u), b, lam)
        w2 -= flow(law, y[P2], p.ambient, c2 * p.nozzle_ratio * (1.0 + u), b, lam)
    elif p.stage == REGULATED:
        w1 = flow(law, y[U1], y[P1], c1, b, lam)
        w2 = flow(law, y[U2], y[P2], c2, b, lam)
    else:
        top = p.supply * factor
        up1 = min(max(factor * (e.middle * p.middle + u), p.ambient), top)
        up2 = min(max(factor * (e.middle * p.middle - u), p.ambient), top)
        w1 = flow(law, up1, y[P1], c1, b, lam)
        w2 = flow(law, up2, y[P2], c2, b, lam)
    return w1, w2, p.leak * (y[P1] - y[P2])


@part(error_model="numpy")
def regulated(  # noqa: PLR0917
    asked: float, pressure: float, integral: float, drawn: float, top: float, p: Record
) -> tuple[float, float]:
    """Rates of a regulator's outlet pressure [Pa/s] and of its integral part [1/s].

    Args:
        asked: pressure asked for [Pa].
        pressure: at the outlet [Pa].
        integral: of the opening.
        drawn: flow that leaves the outlet, times R T0 [Pa m^3/s].
        top: pressure of the supply [Pa].
    """
    error = asked - pressure
    wanted = p.regulator_gain * error + integral
    opening = min(max(wanted, -1.0), 1.0)
    end = top if opening > 0.0 else p.ambient
    through = flow(p.flow, end, pressure, p.regulator_flow, p.critical_ratio, p.laminar)
    winds_up = wanted != opening and wanted * error > 0.0
    rate = 0.0 if winds_up else p.regulator_reset * error
    return (abs(opening) * through - drawn) / p.outlet, rate


@part(error_model="numpy")
def gas_rates(  # noqa: PLR0917
    pressure: float, temperature: float, volume: float, widening: float, w: float, p: Record
) -> tuple[float, float]:
    """Rates of pressure [Pa/s] and temperature [K/s] of a chamber that gets the flow `w`."""
    if p.heat != ENERGY:
        n = p.exponent if p.heat == POLYTROPIC else 1.0
        return n * (w - pressure * widening) / volume, 0.0
    t0 = p.temperature
    # Gas that leaves is warmer or colder than T0: less or more mass, with more or less heat.
    mass_flow = w if w > 0.0 else w * math.sqrt(t0 / temperature)
    heat_flow = mass_flow * (1.0 if w > 0.0 else temperature / t0)
    wall = (GAMMA - 1.0) * p.wall * (t0 - temperature)
    rate = (GAMMA * (heat_flow - pressure * widening) + wall) / volume
    filling = mass_flow * temperature / (t0 * pressure * volume)
    return rate, temperature * (rate / pressure + widening / volume - filling)


@part(error_model="numpy")
def other_forces(y: Floats, p: Record, e: Record) -> float:
    """All forces on the mass but dry friction [N]."""
    x, v = y[X], y[V]
    force = (y[P1] - p.ambient) * p.area_1 - (y[P2] - p.ambient) * p.area_2
    force -= (p.centring + e.spring) * x + e.cubic * x**3 + p.viscous * v + e.drag * v * abs(v)
    over = abs(x) - p.half_stroke
    if over > 0.0:
        outward = v if x > 0.0 else -v
        push = max(_STOP_STIFFNESS * over + _STOP_DAMPING * outward, 0.0)
        force -= push if x > 0.0 else -push
    return force


@kernel(error_model="numpy")
def rates(  # noqa: PLR0917
    y: Floats, dy: Floats, u: float, time: float, p: Record, e: Record
) -> float:
    """Writes the rates of all states into `dy`, returns the accelerometer's output [m/s^2]."""
    x, v = y[X], y[V]
    net = other_forces(y, p, e)
    net -= dry_friction(p.own_friction, p.own_level, v, y[Z_OWN], net, p)
    level = e.dry + e.binding * abs(x)
    added = 0.0
    dy[Z_ADDED] = 0.0
    if level > 0.0:
        added = dry_friction(p.added_friction, level, v, y[Z_ADDED], net, p)
        dy[Z_ADDED] = bristle_rate(p.added_friction, v, y[Z_ADDED], p)
    a = (net - added) / (p.mass + e.mass)
    w1, w2, across = chamber_flows(y, p, e, time)
    v1 = p.dead_1 + p.area_1 * max(p.half_stroke + x, 1e-3)
    v2 = p.dead_2 + p.area_2 * max(p.half_stroke - x, 1e-3)
    dy[P1], dy[T1] = gas_rates(y[P1], y[T1], v1, p.area_1 * v, w1 - across, p)
    dy[P2], dy[T2] = gas_rates(y[P2], y[T2], v2, -p.area_2 * v, w2 + across, p)
    dy[X], dy[V] = v, a
    if p.valve_damping > 0.0:
        dy[S] = y[S_RATE]
        dy[S_RATE] = p.valve_rate**2 * (u - y[S]) - 2.0 * p.valve_damping * p.valve_rate * y[S_RATE]
    else:
        dy[S], dy[S_RATE] = p.valve_rate * (u - y[S]), 0.0
    if p.stage == REGULATED:
        factor = e.supply * (1.0 + e.ripple * math.sin(e.ripple_rate * time))
        top, asked = p.supply * factor, factor * e.middle * p.middle
        u = p.valve_gain * (y[S] + p.valve_null)
        dy[U1], dy[OPEN_1] = regulated(asked + u, y[U1], y[OPEN_1], w1, top, p)
        dy[U2], dy[OPEN_2] = regulated(asked - u, y[U2], y[OPEN_2], w2, top, p)
    else:
        dy[U1] = dy[U2] = dy[OPEN_1] = dy[OPEN_2] = 0.0
    dy[Z_OWN] = bristle_rate(p.own_friction, v, y[Z_OWN], p)
    dy[LVDT] = p.lvdt_rate * (x - y[LVDT])
    dy[HIGH_1] = p.high_pass_1 * (a - y[HIGH_1])
    dy[HIGH_2] = p.high_pass_2 * (a - y[HIGH_1] - y[HIGH_2])
    lag = 1.0 / p.amplifier_rate + e.accelerometer_lag
    dy[AMPLIFIER] = (a - y[HIGH_1] - y[HIGH_2] - y[AMPLIFIER]) / lag
    return y[AMPLIFIER]


@part(error_model="numpy")
def valve_input(volts: float, before: float, step: float, p: Record, e: Record) -> float:
    """Voltage that moves the valve [V]: faults of the drive, play, limited rate, asymmetry."""
    u = min(max(e.valve_gain * volts, -e.saturation), e.saturation)
    u = math.copysign(max(abs(u) - e.deadband, 0.0), u)
    u *= 1.0 + p.asymmetry if u > 0.0 else 1.0 - p.asymmetry
    half = 0.5 * p.hysteresis
    u = min(max(before, u - half), u + half)
    return before + min(max(u - before, -p.slew * step), p.slew * step)


@part(error_model="numpy")
def runge_kutta(  # noqa: PLR0917
    y: Floats, work: Floats, u: float, time: float, h: float, p: Record, e: Record
) -> None:
    """One classical Runge-Kutta step of `h` [s] in place; `work` has three rows."""
    k, total, probe = work[0], work[1], work[2]
    rates(y, k, u, time, p, e)
    for i in range(STATES):
        total[i] = k[i]
        probe[i] = y[i] + 0.5 * h * k[i]
    rates(probe, k, u, time + 0.5 * h, p, e)
    for i in range(STATES):
        total[i] += 2.0 * k[i]
        probe[i] = y[i] + 0.5 * h * k[i]
    rates(probe, k, u, time + 0.5 * h, p, e)
    for i in range(STATES):
        total[i] += 2.0 * k[i]
        probe[i] = y[i] + h * k[i]
    rates(probe, k, u, time + h, p, e)
    for i in range(STATES):
        y[i] += h / 6.0 * (total[i] + k[i])


@kernel(allocates=True, error_model="numpy")
def simulate(  # noqa: PLR0917
    volts: Floats,
    feedback: float,
    noise: Floats,
    late: NDArray[np.int64],
    hidden: NDArray[np.void],
    onset: int,
    member: NDArray[np.void],
    y: Floats,
    rate: float,
    out: Floats,
) -> float:
    """Runs n samples from the states `y`, which it advances; returns the largest |x| [m].

    Args:
        volts: the generator's voltage at every step, shape (n, SUBSTEPS) [V].
        feedback: of the measured position onto the voltage, held from sample to sample [V/m].
        noise: of the LVDT [m] and the accelerometer [m/s^2], shape (n, 2).
        late: steps after the voltage's at which the two are sampled, 0 to SUBSTEPS - 1.
        hidden: effects before the sample `onset` and from it on, shape (2,).
        member: one record of the member, shape (1,).
        rate: samples a second [Hz].
        out: voltage, position and acceleration as measured, shape (n, 3).
    """
    p: Record = member[0]
    h = 1.0 / (rate * SUBSTEPS)
    work = np.zeros((3, STATES))
    u, back, largest = y[S], 0.0, 0.0
    for n in range(volts.shape[0]):
        e: Record = hidden[1 if n >= onset else 0]
        for j in range(SUBSTEPS):
            time = (n * SUBSTEPS + j) * h
            command = volts[n, j] + back
            if j == 0:
                out[n, 0] = command
            if j == late[0]:
                position = y[LVDT] + p.lvdt_offset + noise[n, 0]
                out[n, 1] = round(position / p.lvdt_step) * p.lvdt_step
            if j == late[1]:
                out[n, 2] = y[AMPLIFIER] + noise[n, 1]
            u = valve_input(command, u, h, p, e)
            runge_kutta(y, work, u, time, h, p, e)
        back = -feedback * out[n, 1]
        largest = max(largest, abs(y[X]))
    return largest
