"""A drive that is measured wrongly from the start, where equations predict the motion.

Rigs are drawn, commissioned from a chirp and two sines, and driven by motions within what was
recorded and by others. A wrong drive is to be named with its factor. A rig whose drive is right and
that has a fault from its first sample on is not to be blamed for its drive.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from benchmarks.watching.other_faults import value_of
from benchmarks.watching.rig import blocks, record_of
from benchmarks.watching.unseen_faults import drawn_plant
from monitor.commissioning.equations import commission_equations
from monitor.model import RigModel
from monitor.pipeline.rig_monitor import RigMonitor
from monitor.signals.recordings import Role
from monitor.wiring import DRIVE
from rigwatch.wire.messages import Alarm, SampleBlock
from sim_plant.effects import EFFECTS, Effect
from sim_plant.excitation import Chirp, Excitation, Multisine, Sine, Square, Triangle
from sim_plant.parameters import RigParameters
from sim_plant.scenario import Event, Scenario
from tools.benchmark_table import Row

FACTORS = (-1.0, 10.0, 0.1, 1000.0, 0.001)
STRENGTHS = (0.5, 1.0, 2.0, 4.0)
"""Shares of an effect's typical strength."""
SEED, RIGS, QUICK_RIGS = 351_000, 3, 1
LENGTH, CHIRP = 12.0, 14.0
BLOCK = 128


@dataclass(frozen=True)
class DrawnRig:
    """A rig, its model, and what drives it, by name; `recorded` is within what was recorded."""

    plant: RigParameters
    model: RigModel
    recorded: dict[str, Excitation]
    others: dict[str, Excitation]


def drawn_rig(number: int) -> DrawnRig:
    """A drawn rig, commissioned from healthy recordings alone."""
    draw = np.random.default_rng(SEED + number)
    plant = drawn_plant(draw)
    first, second = draw.uniform(4.0, 10.0, 2)
    small, large = np.sort(draw.uniform(0.8, 1.6, 2))
    sweep = Chirp(amplitude=0.7, start=0.5, stop=20.0, length_s=CHIRP)
    one = Sine(amplitude=float(large), frequency=float(first))
    other = Sine(amplitude=float(small), frequency=float(second))
    healthy: tuple[tuple[Role, Excitation], ...] = (
        ("chirp", sweep),
        ("healthy", one),
        ("healthy", other),
    )
    model = commission_equations(
        [
            record_of(_scenario(plant, drive, CHIRP), role, SEED + 10 * number + k)
            for k, (role, drive) in enumerate(healthy)
        ]
    )
    recorded: dict[str, Excitation] = {
        "recorded": one,
        "smaller": structs.replace(one, amplitude=0.7 * one.amplitude),
        "between": structs.replace(other, frequency=0.5 * (one.frequency + other.frequency)),
        "chirp": structs.replace(sweep, amplitude=0.6),
    }
    others: dict[str, Excitation] = {
        "triangle": Triangle(amplitude=0.9 * one.amplitude, frequency=one.frequency),
        "square": Square(amplitude=0.6 * other.amplitude, frequency=0.7 * other.frequency),
        "multisine": Multisine(amplitude=1.5, start=0.5, stop=12.0, period=1024, seed=number),
    }
    return DrawnRig(plant, model, recorded, others)


def _scenario(
    plant: RigParameters, drive: Excitation, length: float, events: tuple[Event, ...] = ()
) -> Scenario:
    return Scenario(name="drawn", duration_s=length, plant=plant, excitation=drive, events=events)


def named(model: RigModel, case: Scenario, seed: int, factor: float = 1.0) -> tuple[float, float]:
    """When a wrong drive is named [s], and the factor of the alarm; NaN if none is."""
    monitor = RigMonitor(model)
    for block in blocks(case, seed, BLOCK):
        found = monitor.update(_measured(block, factor))
        for said in found.announcements if found is not None else ():
            if isinstance(said, Alarm) and said.name == DRIVE:
                return said.seq / model.sample_rate, said.value
    return np.nan, np.nan


def _measured(block: SampleBlock, factor: float) -> SampleBlock:
    """The block with its drive, which comes first, as it is measured."""
    drive, *rest = block.channels
    return replace(block, channels=(replace(drive, values=factor * drive.values), *rest))


def run(quick: bool) -> list[Row]:
    """Wrong drives named, and right ones blamed."""
    rigs = [drawn_rig(number) for number in range(QUICK_RIGS if quick else RIGS)]
    return [
        _named_row("motions within what was recorded", [(one, one.recorded) for one in rigs]),
        _named_row("other motions", [(one, one.others) for one in rigs]),
        _blamed_row(rigs),
    ]


def _named_row(what: str, driven: list[tuple[DrawnRig, dict[str, Excitation]]]) -> Row:
    times, wrong, missed = [], [], []
    for number, (rig, drives) in enumerate(driven):
        for name, drive in drives.items():
            case = _scenario(rig.plant, drive, LENGTH)
            for factor in (1.0, *FACTORS):
                when, found = named(rig.model, case, SEED + number, factor)
                told = f"{name} of rig {number} times {factor:g}"
                if factor == 1.0:
                    wrong += [] if np.isnan(found) else [told]
                elif np.isnan(found):
                    missed.append(told)
                elif np.isclose(found * factor, 1.0):
                    times.append(when)
                else:
                    wrong.append(told)
    count = len(FACTORS) * sum(len(drives) for _, drives in driven)
    longest = f", within {max(times):.1f} s" if times else ""
    return Row(
        f"wrong drives, {what}",
        f"{len(times)} of {count} named{longest}; {len(wrong)} wrongly",
        "0 wrongly",
        "",
        "; ".join([*wrong, *missed][:12]),
        passed=not wrong,
    )


def _blamed_row(rigs: list[DrawnRig]) -> Row:
    blamed, count = [], 0
    for number, rig in enumerate(rigs):
        for name in ("recorded", "between"):
            for told, events in _faults():
                case = _scenario(rig.plant, rig.recorded[name], LENGTH, events)
                count += 1
                if np.isfinite(named(rig.model, case, SEED + number)[1]):
                    blamed.append(f"{told} ({name}, rig {number})")
    return Row(
        "right drives of rigs with a fault from the start",
        f"{len(blamed)} of {count} blamed",
        "0",
        "",
        "; ".join(blamed[:12]),
        passed=not blamed,
    )


def _faults() -> Iterator[tuple[str, tuple[Event, ...]]]:
    """Each effect at each strength that it can have, from the first sample on."""
    for effect in EFFECTS.values():
        for strength in STRENGTHS:
            value = value_of(effect, strength)
            if effect.low <= value <= effect.high:
                yield f"{effect.name} x{strength:g}", _events(effect, value)


def _events(effect: Effect, value: float) -> tuple[Event, ...]:
    needed = [Event(at_s=0.0, effect=name, value=level) for name, level in effect.needs]
    return (Event(at_s=0.0, effect=effect.name, value=value), *needed)
