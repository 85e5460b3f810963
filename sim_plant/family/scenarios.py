"""The recordings of a member: names, onsets and excitations as those of a foreign rig.

`watch` has healthy recordings, dry friction from a known time and other faults; `explain` a
multisine of five periods with one hidden effect each. `hard_*` in `watch` are excitations that
the foreign rig's folder lacks. Strengths are drawn from the member's seed and the recording's name.
"""

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from sim_plant.family.drives import Drive, voltage
from sim_plant.family.member import RATE, Member, free_run

SINE8, SINE4 = Drive("sine", 1.4, 8.0), Drive("sine", 1.5, 4.0)
SQUARE8, TRIANGLE8 = Drive("square", 1.0, 8.0), Drive("triangle", 1.2, 8.0)
FREE_SINE8, FREE_TRIANGLE8 = (
    Drive("sine", 1.4, 8.0, free=True),
    Drive("triangle", 1.2, 8.0, free=True),
)
ONSET_S, WATCH_S, QUIET_S, EXPLAIN_S = 10.0, 20.0, 60.0, 40.0
EXPERIMENTS = (
    (1.0, SINE8),
    (3.05, SINE8),
    (2.9, Drive("sine", 1.5, 8.0)),
    (3.05, Drive("sine", 1.2, 8.0)),
    (2.9, SINE4),
    (2.8, SQUARE8),
    (2.7, TRIANGLE8),
)
"""Onset [s] and drive of the thesis's seven experiments."""
HARD: dict[str, Drive] = {
    "noise": Drive("noise", 0.6, seed=5),
    "chirp": Drive("chirp", 0.7),
    "loop": Drive("sine", 1.2, 7.0, loop=True),
    "amplitude": Drive("sine", 1.0, 8.0, changes=((8.0, 1.4, 1.0), (12.0, 1.15, 1.0))),
    "frequency": Drive("sine", 1.4, 8.0, changes=((8.0, 1.0, 1.2), (12.0, 1.0, 0.9))),
    "late_start": Drive("sine", 1.4, 8.0, changes=((0.0, 0.0, 1.0), (8.0, 1.0, 1.0))),
    "free_loop": Drive("sine", 1.2, 6.0, free=True, loop=True),
}
HARD_S, HARD_ONSET_S = 30.0, 18.0


@dataclass(frozen=True)
class Scenario:
    """One recording.

    Attributes:
        what: description in truth.json; `from_s`: onset there [s].
        hidden: effects of the plant by the kernel's names, from `from_s` on.
        sensor: fault of a sensor, its value: gain, stuck, noise, delay, smoothing of the
            acceleration, or bias of the position.
    """

    what: str
    drive: Drive
    seconds: float
    from_s: float | None = None
    hidden: dict[str, float] = field(default_factory=dict)
    sensor: tuple[str, float] | None = None


class Strengths:
    """Draws strengths for a recording of a member, scaled to its motion."""

    def __init__(self, member: Member, name: str) -> None:
        self._random = np.random.default_rng([member.seed, *name.encode()])
        self.member = member
        self.force = tuned_force(member)

    def __call__(self, low: float, high: float) -> float:
        """A number between the two."""
        return float(self._random.uniform(low, high))

    def friction(self) -> dict[str, float]:
        """Dry friction of some 0.5 to 0.9 N."""
        return {"dry": float(np.clip(self(0.17, 0.25) * self.force, 0.5, 0.9))}


@cache
def tuned_force(member: Member) -> float:
    """Largest force on the healthy mass [N] with 1.4 V at 8 Hz."""
    out = free_run(member, voltage(SINE8, member, 4.0)[:, 0], member.rest.copy())
    return float(member["mass"] * np.ptp(out[-round(RATE) :, 2]) / 2)


@cache
def held_back(member: Member, drive: Drive, seconds: float, most: float) -> Drive:
    """The drive with the voltage at which the healthy mass stays within `most` [m]."""
    for _ in range(4):
        out = free_run(member, voltage(drive, member, seconds)[:, 0], member.rest.copy())
        if (moved := float(np.abs(out[:, 1]).max())) <= most:
            break
        drive = replace(drive, volts=drive.volts * 0.95 * most / moved)
    return drive


def watch(member: Member) -> dict[str, Scenario]:
    """The recordings of the part `watch`, by name."""
    chirp = held_back(member, Drive("chirp", 0.5), EXPLAIN_S, 0.040)
    multisine = held_back(member, Drive("multisine", 0.35, seed=11), 24.0, 0.024)
    made = {
        "chirp": Scenario("chirp, healthy", chirp, EXPLAIN_S),
        "multisine": Scenario("multisine, healthy", multisine, 24.0),
    }
    for name, drive, quiet in (
        ("sine8", SINE8, True),
        ("sine4", held_back(member, SINE4, 4.0, 0.030), False),
        ("square8", SQUARE8, False),
        ("triangle8", TRIANGLE8, False),
        ("sine8_free", FREE_SINE8, True),
        ("triangle8_free", FREE_TRIANGLE8, True),
    ):
        made[f"healthy_{name}"] = Scenario("healthy", drive, WATCH_S)
        made[f"friction_{name}"] = _friction(member, f"friction_{name}", drive, WATCH_S, ONSET_S)
        if quiet:
            made[f"quiet_{name}"] = Scenario("healthy", drive, QUIET_S)
    made["start_stop_change"] = _start_stop_change()
    for number, (onset, drive) in enumerate(EXPERIMENTS, 1):
        name, held = f"experiment_{number}", held_back(member, drive, 4.0, 0.030)
        made[name] = _friction(member, name, held, 8.0, onset)
    return made | _faults(member) | _hard(member)


def _friction(member: Member, name: str, drive: Drive, seconds: float, onset: float) -> Scenario:
    hidden = Strengths(member, name).friction()
    return Scenario("dry friction", drive, seconds, onset, hidden)


def _start_stop_change() -> Scenario:
    changes = ((0.0, 0.0, 1.0), (10.0, 1.0, 1.0), (30.0, 0.0, 1.0), (35.0, 1.0, 1.0))
    what = (
        "healthy; excitation starts at 10 s, stops at 30 s, starts at 35 s, falls to 80 % at 45 s"
    )
    return Scenario(what, replace(SINE8, changes=(*changes, (45.0, 0.8, 1.0))), QUIET_S)


def _faults(member: Member) -> dict[str, Scenario]:
    """Faults that are not friction: sensors from 10 s on, the others from the start."""
    s = Strengths(member, "faults")
    sensors = {
        "accel_gain": ("gain", s(0.75, 0.85)),
        "accel_stuck": ("stuck", 1.0),
        "position_bias": ("bias", s(1.5e-3, 2.5e-3)),
        "accel_noise": ("noise", s(1.5, 2.5)),
    }
    plant = {
        "deadband": {"deadband": s(0.15, 0.25)},
        "saturation": {"saturation": s(0.8, 1.05)},
        "supply": {"middle" if member.flavour.regulated else "supply": s(0.7, 0.85)},
        "valve_gain": {"valve_gain": s(0.8, 0.88)},
        "mass": {"mass": s(0.12, 0.2) * member["mass"]},
        "spring": {"spring": s(100.0, 180.0)},
    }
    made = {
        f"fault_{name}": Scenario("other fault", SINE8, WATCH_S, ONSET_S, sensor=fault)
        for name, fault in sensors.items()
    }
    for name, hidden in plant.items():
        made[f"fault_{name}"] = Scenario("other fault", SINE8, WATCH_S, 0.0, hidden)
    return made


def _hard(member: Member) -> dict[str, Scenario]:
    made = {}
    for name, hard in HARD.items():
        drive = held_back(member, hard, HARD_S, 0.035)
        made[f"hard_{name}"] = Scenario(f"healthy; hard: {name}", drive, HARD_S)
        rubbing = f"hard_{name}_friction"
        made[rubbing] = _friction(member, rubbing, drive, HARD_S, HARD_ONSET_S)
    return made


def explain(member: Member) -> dict[str, Scenario]:
    """The recordings of the part `explain`, by name."""
    drive = held_back(member, Drive("multisine", 0.30, seed=21), 16.0, 0.024)
    other = replace(drive, seed=22)
    made = {
        name: Scenario(name, drive, EXPLAIN_S, 0.0, hidden)
        for name, hidden in _hidden(member, drive).items()
    }
    s = Strengths(member, "explain")
    gain = s(1.04, 1.08) if s(0, 1) < 0.5 else s(0.92, 0.96)
    made["accel_gain"] = replace(made["none"], what="accel_gain", sensor=("gain", gain))
    made["accel_late"] = _late(member, s, made["none"])
    weak = made["coulomb"].hidden
    made["coulomb_other_excitation"] = Scenario("coulomb", other, EXPLAIN_S, 0.0, weak)
    made["healthy_other_excitation"] = Scenario("healthy", other, EXPLAIN_S)
    return made


def _hidden(member: Member, drive: Drive) -> dict[str, dict[str, float]]:
    """Effects of the plant, as strong relative to the motion as on the foreign rig."""
    s = Strengths(member, "hidden")
    out = free_run(member, voltage(drive, member, 16.0)[:, 0], member.rest.copy())
    x = float(np.abs(out[:, 1]).max())
    v = float(np.abs(np.gradient(out[:, 1], 1 / RATE)).max())
    cubic = {"cubic": s(0.15, 0.35) * s.force / x**3}
    weak = {"dry": s(0.03, 0.05) * s.force}
    softer = member.flavour.softer
    spring = s(-0.55, -0.35) * member["centring"] if softer else s(60.0, 140.0)
    return {
        "healthy": {},
        "none": {},
        "coulomb": weak,
        "coulomb_strong": {"dry": s(0.1, 0.15) * s.force},
        "spring": {"spring": spring},
        "cubic": cubic,
        "drag": {"drag": s(0.12, 0.25) * s.force / v**2},
        "deadband": {"deadband": s(0.03, 0.06)},
        "saturation": {"saturation": s(1.5, 1.8) * drive.volts},
        "binding": {"binding": s(0.08, 0.16) * s.force / x},
        "two": cubic | weak,
        "pressure": _stranger(member, s),
    }


def _stranger(member: Member, s: Strengths) -> dict[str, float]:
    """An effect that is not in the library."""
    match member.flavour.stranger:
        case "ripple":
            return {"ripple": s(0.04, 0.08), "ripple_rate": 2 * np.pi * s(2.2, 6.0)}
        case "middle":
            return {"middle": s(0.75, 0.85)}
        case _:
            return {"blockage": s(0.4, 0.6)}


def _late(member: Member, s: Strengths, none: Scenario) -> Scenario:
    """The accelerometer delayed by a lag, by a sample or by digital smoothing."""
    late = replace(none, what="accel_late")
    match member.flavour.late_fault:
        case "lag":
            return replace(late, hidden={"accelerometer_lag": s(2e-3, 4e-3)})
        case "delay":
            return replace(late, sensor=("delay", 1.0))
        case _:
            return replace(late, sensor=("smoothing", s(0.5, 0.7)))
