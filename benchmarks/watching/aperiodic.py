"""Aperiodic drives: false alarms in friction-free running, and the delay of detecting friction.

There is no healthy period to compare with, so the residual itself is judged. A fault is detected
but not named: no name counts as right here, any name as wrong.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.watching.rig import (
    RATE,
    active,
    blocks,
    clipped,
    commissioned,
    delay,
    scenario,
    watched,
)
from monitor.pipeline.pipeline import Monitor
from monitor.signals.conditions import (
    DEPARTURE,
    DRY_FRICTION,
    EXCITATION_CHANGED,
    OTHER_FAULT,
    STICTION,
)
from sim_plant.excitation import Chirp, Excitation, Multisine, Recorded
from sim_plant.scenario import Event, Scenario
from tools.benchmark_table import Row

HOURS, QUICK_HOURS = 24.0, 1.0
SEEDS, QUICK_SEEDS = 20, 4
LEVELS = (0.1, 0.2, 0.4)
"""Coulomb friction [N]; 0.4 is the known fault that the signature is scaled by."""
LENGTH = 80.0
_NAMES = (DRY_FRICTION, STICTION, OTHER_FAULT, EXCITATION_CHANGED)


@dataclass(frozen=True)
class Noticed:
    """Delay until friction was detected [s], None if never; whether it was named, alarmed early."""

    delay: float | None
    named: bool
    early: bool


def drives() -> dict[str, Excitation]:
    """Noise, lines that repeat after four minutes, and a chirp longer than any period looked
    for.
    """
    lines = np.arange(240, 3600)
    spectrum = np.zeros(30721, np.complex128)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(1).random(lines.size))
    volts = np.fft.irfft(spectrum, 61440)
    noise = tuple((0.6 * volts / volts.std()).tolist())
    return {
        "noise, 1 to 15 Hz": Recorded(samples=noise, loop=True),
        "multisine of 256 s": Multisine(amplitude=1.4, start=0.5, stop=20.0, period=65536),
        "chirp of 16 s": Chirp(amplitude=0.7, start=0.5, stop=20.0, length_s=16.0),
    }


def run(quick: bool) -> list[Row]:
    """A row a drive for false alarms, and one for each level of friction."""
    hours, seeds = (QUICK_HOURS, QUICK_SEEDS) if quick else (HOURS, SEEDS)
    rows = []
    for name, drive in drives().items():
        rows.append(_quiet(name, drive, hours))
        rows += [_noticed(name, drive, level, seeds) for level in LEVELS]
    return rows


def _case(drive: Excitation, seconds: float, events: tuple[Event, ...] = ()) -> Scenario:
    plant = scenario("experiment_2").plant
    return Scenario(
        name="aperiodic", duration_s=seconds, lead_in_s=10.0, plant=plant, excitation=drive,
        events=events,
    )  # fmt: skip


def _quiet(name: str, drive: Excitation, hours: float) -> Row:
    monitor, alarmed, largest, samples = Monitor(commissioned()), 0, 0.0, 0
    for block in blocks(_case(drive, hours * 3600.0), 9000, size=65536):
        result = monitor.update(block)
        if result is None:
            continue
        alarmed += sum(int(active([result], kind).sum()) for kind in (DEPARTURE, *_NAMES))
        alarmed += int(clipped([result], 0.0))
        largest = max(largest, float(result.estimates.column("deviation").values.max()))
        samples += len(block)
    return Row(
        f"false alarms, {name}",
        f"{alarmed} in {hours:g} h",
        "0",
        "",
        f"{samples / 1e6:.1f} million samples; largest deviation {largest:.2f} of "
        f"{monitor.rules.factor:.2f} allowed",
        passed=alarmed == 0,
    )


def _noticed(name: str, drive: Excitation, level: float, seeds: int) -> Row:
    draw = np.random.default_rng(9100)
    outcomes = [_outcome(drive, level, float(draw.uniform(30.0, 50.0)), k) for k in range(seeds)]
    found = sorted(o.delay for o in outcomes if o.delay is not None)
    named, early = sum(o.named for o in outcomes), sum(o.early for o in outcomes)
    times = f"median {np.median(found):.1f} s, worst {found[-1]:.1f} s" if found else "never"
    return Row(
        f"friction of {level:g} N, {name}",
        f"noticed in {len(found)} of {seeds}, {times}; given a name in {named}",
        "noticed, no name",
        "",
        f"onset at random; alarmed before it in {early}",
        passed=len(found) == seeds and named == 0 and early == 0,
    )


def _outcome(drive: Excitation, level: float, onset: float, seed: int) -> Noticed:
    case = _case(drive, LENGTH, (Event(at_s=onset, effect="coulomb", value=level),))
    results = watched(case, 9200 + seed)
    named = any(active(results, kind).any() for kind in _NAMES)
    early = bool(active(results, DEPARTURE)[: int(onset * RATE)].any())
    return Noticed(delay(results, DEPARTURE, onset), named, early)
