"""One member of the family: its laws, and quantities drawn from a seed.

Restrictions are drawn by the pressure drop that a moving piston causes across them, and the valve's
gain by the motion that 1.4 V at 8 Hz causes, so members of all laws have similar motions.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sim_plant.family import kernel, quantities
from sim_plant.family.flavours import FLAVOURS, Flavour
from sim_plant.family.laws import Heat
from sim_plant.family.quantities import ROOM_TEMPERATURE

RATE = 256.0
"""Samples a second [Hz]."""
_REST_S = 6.0
_TUNED_VOLTS, _TUNED_HZ = 1.4, 8.0


@dataclass(frozen=True, eq=False)
class Member:
    """A rig of the family.

    Attributes:
        flavour: the laws that fix its equations.
        seed: of everything drawn.
        record: laws and quantities for the kernel, shape (1,).
        noise: of the LVDT [m] and the accelerometer [m/s^2].
        late: steps of `kernel.SUBSTEPS` at which the two are sampled after the voltage.
        smoothing: weight of the newest sample in the DAQ's digital filter, 1 for none.
        ramp_s: time to the full amplitude [s].
        clock: share by which the free generator runs fast.
        clock_drift: change of that in a second [1/s].
        feedback: of the position onto the voltage with a controller in the loop [V/m].
        rest: states at rest with 0 V, shape (STATES,).
    """

    name: str
    flavour: Flavour
    seed: int
    record: NDArray[np.void]
    noise: tuple[float, float]
    late: tuple[int, int]
    smoothing: float
    ramp_s: float
    clock: float
    clock_drift: float
    feedback: float
    rest: NDArray[np.float64] = field(default_factory=lambda: np.zeros(kernel.STATES))

    def __getitem__(self, quantity: str) -> float:
        return float(self.record[quantity][0])

    @property
    def air_spring_hz(self) -> float:
        """Natural frequency of the mass on both closed chambers at mid stroke [Hz]."""
        exponent = {Heat.ISOTHERMAL: 1.0, Heat.POLYTROPIC: self["exponent"], Heat.ENERGY: 1.4}
        n, length = exponent[self.flavour.heat], self["half_stroke"]
        stiffness = self["centring"]
        for i, pressure in ((1, self.rest[kernel.P1]), (2, self.rest[kernel.P2])):
            area = self[f"area_{i}"]
            stiffness += n * pressure * area**2 / (self[f"dead_{i}"] + area * length)
        return float(np.sqrt(stiffness / self["mass"]) / (2 * np.pi))


def draw(flavour: str, seed: int) -> Member:
    """A member of `flavour`; the same seed gives the same member."""
    kind = FLAVOURS[flavour]
    random = np.random.default_rng([seed, *flavour.encode()])
    record = np.zeros(1, dtype=kernel.MEMBER_TYPE)
    for part in quantities.PARTS:
        for key, value in part(kind, random).items():
            record[key] = value
    quantities.set_restrictions(record, random)
    reach = random.uniform(5.0e-3, 8.0e-3)
    member = Member(
        name=f"{flavour}_{seed}",
        flavour=kind,
        seed=seed,
        record=record,
        noise=(random.uniform(1e-6, 8e-6), random.uniform(0.03, 0.12)),
        late=quantities.lateness(kind, random),
        smoothing=random.uniform(0.55, 0.8) if kind.smoothed else 1.0,
        ramp_s=0.0 if kind.abrupt else random.uniform(0.2, 1.0),
        clock=quantities.clock(kind, random),
        clock_drift=random.uniform(2e-5, 6e-5) if kind.drifting else 0.0,
        feedback=random.uniform(0.5, 1.0),
    )
    return _tuned(member, reach, random.uniform(-0.01, 0.01))


def _tuned(member: Member, reach: float, offset: float) -> Member:
    """Valve's null trimmed to rest at mid stroke, but for `offset` [V], and its gain to `reach`."""
    p, newtons_per_volt = member.record, 1.0
    for _ in range(8):
        rest = at_rest(member)
        newtons_per_volt = member["mass"] * reach * (2 * np.pi * _TUNED_HZ) ** 2 / _TUNED_VOLTS
        p["valve_null"] -= member["centring"] * rest[kernel.X] / newtons_per_volt
        factor = reach / _motion(member, rest)
        p["valve_gain"] *= factor
        p["valve_null"] /= factor
    p["valve_null"] += offset
    rest = at_rest(member)
    p["lvdt_offset"] -= rest[kernel.X]
    feedback = member.feedback * member["centring"] / newtons_per_volt
    return replace(member, rest=rest, feedback=feedback)


def at_rest(member: Member, hidden: dict[str, float] | None = None) -> NDArray[np.float64]:
    """States some seconds after the valve got 0 V, with `hidden` effects of the plant."""
    y = member.rest.copy()
    if y[kernel.P1] == 0.0:
        y[[kernel.P1, kernel.P2, kernel.U1, kernel.U2]] = member["middle"]
        y[[kernel.T1, kernel.T2]] = ROOM_TEMPERATURE
    free_run(member, np.zeros(round(_REST_S * RATE)), y, hidden)
    y[[kernel.V, kernel.S_RATE, kernel.HIGH_1, kernel.HIGH_2, kernel.AMPLIFIER]] = 0.0
    return y


def _motion(member: Member, rest: NDArray[np.float64]) -> float:
    """Half the range of the motion [m] that settles with the tuning voltage."""
    t = np.arange(round(3 * RATE)) / RATE
    volts = _TUNED_VOLTS * np.sin(2 * np.pi * _TUNED_HZ * t)
    x = free_run(member, volts, rest.copy())[-round(RATE) :, 1]
    return float(np.ptp(x)) / 2


def free_run(
    member: Member,
    volts: NDArray[np.float64],
    y: NDArray[np.float64],
    hidden: dict[str, float] | None = None,
) -> NDArray[np.float64]:
    """Voltage, position, acceleration without noise, shape (n, 3); advances `y`.

    `hidden` effects of the plant hold from the first sample on.
    """
    out = np.empty((volts.size, 3))
    kernel.simulate(
        np.repeat(volts[:, None], kernel.SUBSTEPS, axis=1),
        0.0,
        np.zeros((volts.size, 2)),
        np.zeros(2, dtype=np.int64),
        kernel.hidden_effects(hidden or {}),
        0,
        member.record,
        y,
        RATE,
        out,
    )
    return out
