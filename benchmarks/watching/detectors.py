"""The detectors of docs/theory.md 3 on the simulated rig, compared with the friction scheme.

All four run in one monitor on the same samples with the same persistence, calibrated from one model
file. A delay is counted from the onset of the fault to the sample that raises the alarm.
"""

import numpy as np
from msgspec import structs

from benchmarks.watching.rig import RATE, blocks, commissioned, scenario
from monitor.detectors import DETECTORS
from monitor.detectors.selection import detectors_of
from monitor.model import RigModel
from monitor.pipeline import RigMonitor
from rigwatch.wire.messages import Alarm
from sim_plant.scenario import Event, Scenario
from tools.benchmark_table import Row

SCHEMES = {
    "departure": "friction scheme",
    "parity_arma": "ARMA",
    "parity_ma": "MA",
    "unknown_input": "Kalman",
}
NAMED = ("departure", "dry_friction", "stiction", "other_fault")
FAULTS = (
    ("coulomb", 0.22, "dry friction, air slightly reduced"),
    ("coulomb", 0.75, "dry friction, air cut off"),
    ("viscous", 2.0, "viscous friction"),
    ("spring", 150.0, "spring to mid stroke"),
    ("chamber_leak", 0.02, "leak across the piston"),
    ("actuator_deadband", 0.2, "dead band of the valve"),
    ("voltage_bias", 0.3, "bias of the voltage reading"),
    ("position_bias", 3e-3, "bias of the position reading"),
    ("position_gain", 0.8, "gain of the position reading"),
    ("acceleration_gain", 0.8, "gain of the acceleration reading"),
)
FAULT_S, END_S = 12.0, 20.0


def run(quick: bool) -> list[Row]:
    """Delays by fault, and false alarms by detector."""
    model = commissioned()
    seeds = range(40, 42) if quick else range(40, 45)
    rows = [_fault_row(model, *fault, list(seeds)) for fault in FAULTS]
    return rows + _false_alarm_rows(model, minutes=5 if quick else 120)


def _fault_row(model: RigModel, effect: str, value: float, what: str, seeds: list[int]) -> Row:
    delays: dict[str, list[float]] = {name: [] for name in SCHEMES}
    for seed in seeds:
        event = Event(at_s=FAULT_S, effect=effect, value=value)
        faulty = structs.replace(_healthy(END_S), events=(event,))
        for name, seq in _raised(model, faulty, seed).items():
            delays[name].append((seq / RATE - FAULT_S) * 1e3)
    measured = "; ".join(
        f"{label} {_delay(delays[name], len(seeds))}" for name, label in SCHEMES.items()
    )
    note = f"{effect} = {value:g}; median of {len(seeds)} seeds, 8 Hz sine at 1.4 V"
    return Row(f"detection delay: {what}", measured, "", "", note, None)


def _delay(delays: list[float], runs: int) -> str:
    if not delays:
        return "none"
    share = "" if len(delays) == runs else f" ({len(delays)}/{runs})"
    return f"{np.median(delays):.0f} ms{share}"


def _false_alarm_rows(model: RigModel, minutes: int) -> list[Row]:
    raised = _raised(model, _healthy(60.0 * minutes), seed=77)
    return [
        Row(
            f"false alarms of a healthy rig: {label}",
            f"{int(name in raised)} in {minutes} min",
            "0",
            "",
            "8 Hz sine at 1.4 V, friction-free",
            name not in raised,
        )
        for name, label in SCHEMES.items()
    ]


def _healthy(seconds: float) -> Scenario:
    return scenario("healthy_sine_8hz_1v4").healthy(seconds)


def _raised(model: RigModel, case: Scenario, seed: int) -> dict[str, int]:
    """Sample that first raised each scheme's alarm, by scheme; one raised before a fault counts."""
    names = tuple(kind.name for kind in DETECTORS)
    watching = RigMonitor(model, detectors=detectors_of(names, model, "benchmark"))
    first: dict[str, int] = {}
    for block in blocks(case, seed):
        watched = watching.update(block)
        for said in watched.announcements if watched else ():
            if isinstance(said, Alarm) and said.state == "unacknowledged":
                name = NAMED[0] if said.name in NAMED else said.name
                first.setdefault(name, said.seq)
    return {name: seq for name, seq in first.items() if name in SCHEMES}
