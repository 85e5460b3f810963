"""Faults that had no part in choosing a constant: drawn rigs, drives, strengths, times, and pairs.

Each rig differs from the nominal one in mass, pressure, valve, dead volume and noise, and is
commissioned as it is. Each run draws a drive that no experiment and no commissioning recording has,
a strength, and the time of onset. A fault that changes no channel by more than the noise is left
out: there is nothing to see.
"""

from collections import Counter
from dataclasses import dataclass
from functools import cache

import numpy as np
from msgspec import structs

from benchmarks.watching.other_faults import value_of
from benchmarks.watching.rig import RATE, active, blocks, clipped, delay, record_of, scenario
from monitor.commissioning.commission import commission
from monitor.model.model_file import RigModel
from monitor.pipeline.pipeline import Monitor
from monitor.signals.conditions import (
    DEPARTURE,
    DRY_FRICTION,
    EXCITATION_CHANGED,
    OTHER_FAULT,
    STICTION,
)
from monitor.signals.recordings import Role
from rigwatch.wire.arrays import FloatArray
from sim_plant.effects import EFFECTS, Effect
from sim_plant.excitation import Sine, Square, Triangle
from sim_plant.parameters import RigParameters
from sim_plant.scenario import Event, Scenario
from tools.benchmark_table import Row

LENGTH = 20.0
DRIVES: tuple[Sine | Triangle | Square, ...] = (
    Sine(frequency=6.0, amplitude=1.3),
    Sine(frequency=10.0, amplitude=1.0),
    Sine(frequency=3.2, amplitude=1.6),
    Triangle(frequency=5.0, amplitude=1.4),
    Square(frequency=4.0, amplitude=0.8),
)
RIGS, QUICK_RIGS = 8, 1
SEED = 77_000


@dataclass(frozen=True)
class Drawn:
    """One run: what was drawn, and what the monitor made of it."""

    truth: str
    what: str
    rig: int
    drive: str
    visible: bool
    alarmed: bool
    verdict: str


def drawn_plant(draw: np.random.Generator) -> RigParameters:
    """A rig whose mass, pressure, valve, dead volume and noise differ from the nominal ones."""
    nominal = RigParameters()

    def around(value: float, share: float) -> float:
        return float(value * draw.uniform(1.0 - share, 1.0 + share))

    noise = float(draw.uniform(0.7, 2.0))
    return structs.replace(
        nominal,
        load_mass=around(nominal.load_mass, 0.2),
        mean_pressure=around(nominal.mean_pressure, 0.15),
        valve_frequency=around(nominal.valve_frequency, 0.3),
        dead_volume=around(nominal.dead_volume, 0.5),
        piston_viscous=around(nominal.piston_viscous, 0.5),
        lvdt_noise=noise * nominal.lvdt_noise,
        accelerometer_noise=noise * nominal.accelerometer_noise,
        voltage_noise=noise * nominal.voltage_noise,
    )


@cache
def rig(number: int) -> tuple[RigParameters, RigModel]:
    """A drawn rig, and what commissioning makes of it."""
    plant = drawn_plant(np.random.default_rng(SEED + number))
    names: tuple[tuple[str, Role], ...] = (
        ("commissioning_chirp", "chirp"),
        ("healthy_sine_8hz_1v4", "healthy"),
        ("known_friction", "friction"),
    )
    recordings = [
        record_of(structs.replace(scenario(name), plant=plant), role, SEED + 10 * number + k)
        for k, (name, role) in enumerate(names)
    ]
    return plant, commission(recordings)


def cases(rigs: range) -> list[Drawn]:
    """Every effect alone on every rig, and as many pairs of effects that are no friction."""
    found = []
    for number in rigs:
        draw = np.random.default_rng([SEED, number])
        found += [_run(number, (effect,), draw) for effect in EFFECTS.values()]
        others = [effect for effect in EFFECTS.values() if not effect.dry]
        for first in others:
            second = others[int(draw.integers(len(others)))]
            found.append(_run(number, (first, second), draw))
    return found


def _run(number: int, effects: tuple[Effect, ...], draw: np.random.Generator) -> Drawn:
    plant, model = rig(number)
    drive = DRIVES[int(draw.integers(len(DRIVES)))]
    onset, seed = float(draw.uniform(9.0, 12.0)), int(draw.integers(1 << 31))
    healthy = Scenario(
        name="drawn", duration_s=LENGTH, lead_in_s=10.0, plant=plant, excitation=drive
    )
    strengths = [float(np.exp(draw.uniform(np.log(0.4), np.log(2.5)))) for _ in effects]
    events = tuple(
        event
        for effect, strength in zip(effects, strengths, strict=True)
        for event in _events(effect, strength, onset)
    )
    faulty = structs.replace(healthy, events=events)
    monitor = Monitor(model)
    results = [result for block in blocks(faulty, seed) if (result := monitor.update(block))]
    kinds = (DRY_FRICTION, STICTION, OTHER_FAULT, EXCITATION_CHANGED)
    when = {name: delay(results, name, onset) for name in kinds}
    named = [name for name in kinds if when[name] is not None]
    early = active(results, DEPARTURE)[: int(onset * RATE)].any() or clipped(results, 0.0, onset)
    return Drawn(
        truth="dry friction" if any(effect.dry for effect in effects) else "other",
        what=" and ".join(f"{e.name} x{s:.2g}" for e, s in zip(effects, strengths, strict=True)),
        rig=number,
        drive=f"{type(drive).__name__.lower()} {drive.frequency:g} Hz",
        visible=_visible(healthy, faulty, seed, onset, model),
        alarmed=delay(results, DEPARTURE, onset) is not None or clipped(results, onset),
        verdict="alarmed before" if early else named[0] if named else "not named",
    )


def _events(effect: Effect, strength: float, onset: float) -> list[Event]:
    value = min(max(value_of(effect, strength), effect.low), effect.high)
    needed = [Event(at_s=onset, effect=name, value=level) for name, level in effect.needs]
    return [Event(at_s=onset, effect=effect.name, value=value), *needed]


def _visible(healthy: Scenario, faulty: Scenario, seed: int, onset: float, model: RigModel) -> bool:
    """Whether any channel changes by more than its noise, root mean square after the onset."""
    noise = np.array([model.noise.voltage, model.noise.position, model.noise.residual])
    change = (_signals(faulty, seed) - _signals(healthy, seed))[:, int(onset * RATE) :]
    return bool(np.any(np.sqrt(np.mean(change**2, axis=1)) > noise))


def _signals(case: Scenario, seed: int) -> FloatArray:
    parts = [np.array([c.values for c in block.channels]) for block in blocks(case, seed)]
    return np.concatenate(parts, axis=1)


def run(quick: bool) -> list[Row]:
    """Rows for the bar, and the confusion matrix by truth."""
    found = [case for case in cases(range(QUICK_RIGS if quick else RIGS)) if case.visible]
    dry = [case for case in found if case.truth == "dry friction"]
    others = [case for case in found if case.truth == "other"]
    silent = [case for case in found if not case.alarmed]
    wrong = [case for case in others if case.verdict in {DRY_FRICTION, STICTION}]
    missed = [case for case in dry if case.verdict not in {DRY_FRICTION, STICTION}]
    return [
        _row("unseen faults, alarmed", silent, found, "all"),
        _row("unseen other faults called dry friction", wrong, others, "0"),
        _row("unseen dry friction called something else", missed, dry, "0"),
        _matrix("dry friction", dry),
        _matrix("other, alone", [case for case in others if " and " not in case.what]),
        _matrix("other, in pairs", [case for case in others if " and " in case.what]),
    ]


def _row(what: str, failed: list[Drawn], among: list[Drawn], bar: str) -> Row:
    measured = f"{len(among) - len(failed) if bar == 'all' else len(failed)} of {len(among)}"
    note = "; ".join(f"{case.what} (rig {case.rig}, {case.drive})" for case in failed[:12])
    return Row(what, measured, bar, "", note, passed=not failed)


def _matrix(name: str, found: list[Drawn]) -> Row:
    counts = Counter(case.verdict for case in found).most_common()
    return Row(
        f"unseen confusion: {name}",
        ", ".join(f"{verdict} {count}" for verdict, count in counts),
        "", "", "", passed=None,
    )  # fmt: skip
