"""What alarms say is missing: does the first class hold the fault that the simulated rig has?

Two seconds of samples since each alarm are put before the library, as the monitor does it. The
plant (`sim_plant`) shares no equations with the monitor's model.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from benchmarks.watching.rig import RATE, blocks, commissioned, scenario
from monitor.diagnosis.background_ranking import WAIT
from monitor.diagnosis.fault_candidates import LEVEL, Suspect, suspects
from monitor.diagnosis.observed_change import Evidence
from monitor.pipeline.pipeline import Monitor
from monitor.signals.conditions import DEPARTURE
from rigwatch.physics.engine.equations.effect_files import library
from sim_plant.effects import EFFECTS
from sim_plant.scenario import Event
from tools.benchmark_table import Row

ONSET, LENGTH = 5.0, 9.0
RIGHT: dict[str, tuple[str, ...]] = {
    "coulomb": ("coulomb@load",),
    "viscous": ("viscous@load",),
    "spring": ("linear_stiffness@load",),
    "actuator_gain": ("gain@drive", "gain@voltage_sensor"),
    "actuator_deadband": ("dead_band@drive",),
    "actuator_lag": ("lag@drive", "delay@drive"),
    "chamber_leak": ("leakage@chambers",),
    "acceleration_gain": ("gain@acceleration_sensor",),
    "acceleration_bias": ("offset@acceleration_sensor",),
    "acceleration_lag": ("lag@acceleration_sensor", "delay@acceleration_sensor"),
}
"""What the library calls each fault."""


@dataclass(frozen=True)
class Outcome:
    """One fault: its ranking, best first; nothing where no alarm came up."""

    fault: str
    rows: list[Suspect]

    @property
    def named(self) -> str:
        """What the alarm says first."""
        if not self.rows or self.rows[0].p_value >= LEVEL:
            return "cannot tell"
        return self.rows[0].label

    @property
    def first(self) -> bool:
        """Whether the first is right."""
        return self.named in RIGHT[self.fault]

    @property
    def in_class(self) -> bool:
        """Whether the first, or one that it cannot be distinguished from, is right."""
        together = {self.named, *(self.rows[0].alike if self.rows else ())}
        return self.named != "cannot tell" and bool(together & set(RIGHT[self.fault]))


def solve(fault: str, test: int, strength: float, seed: int) -> Outcome | None:
    """One fault under the excitation of an experiment; None where no alarm comes up."""
    effect = EFFECTS[fault]
    value = effect.neutral + strength * (effect.typical - effect.neutral)
    case = structs.replace(
        scenario(f"experiment_{test}").healthy(LENGTH),
        events=(Event(at_s=ONSET, effect=fault, value=value),),
    )
    model = commissioned()
    monitor, signals, change, alarmed = Monitor(model), [], [], []
    for block in blocks(case, seed):
        result = monitor.update(block)
        assert result is not None
        signals.append(np.stack([block.channel(c).values for c in model.channels], axis=1))
        change.append(result.estimates.column("change").values)
        alarmed += [c.active for c in result.conditions if c.name == DEPARTURE]
    raised = np.flatnonzero(np.concatenate(alarmed))
    if not raised.size:
        return None
    end = round(raised[0] + WAIT * RATE)
    kept = np.concatenate(signals)[:end], np.concatenate(change)[:end]
    return Outcome(fault, suspects(Evidence(*kept, int(raised[0])), model, library()))


def run(quick: bool) -> list[Row]:
    """A row for all, one a fault."""
    tests, strengths, seeds = ((2,), (0.5,), 1) if quick else ((2, 3, 4, 5, 7), (0.25, 0.5, 1.0), 2)
    found = [
        outcome
        for fault in RIGHT
        for test in tests
        for strength in strengths
        for seed in range(seeds)
        if (outcome := solve(fault, test, strength, 900 + seed)) is not None
    ]
    return [
        _row("all faults", found),
        *(_row(f, [o for o in found if o.fault == f]) for f in RIGHT),
    ]


def _row(what: str, found: list[Outcome]) -> Row:
    count, sizes = len(found), [1 + len(o.rows[0].alike) for o in found if o.rows]
    named = Counter(o.named for o in found).most_common(4)
    measured = (
        f"first {sum(o.first for o in found)}/{count},"
        f" in the class {sum(o.in_class for o in found)}/{count}"
    )
    note = f"median class {np.median(sizes):g}; " if sizes else ""
    listed = ", ".join(f"{name} {times}" for name, times in named)
    return Row(f"probable cause: {what}", measured, "", "", f"{note}named: {listed}", None)
