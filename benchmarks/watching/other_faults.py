"""Other faults: each raises an alarm and none is named dry friction. The confusion matrix over
all effects of the rig.
"""

from collections import Counter
from dataclasses import dataclass

from msgspec import structs

from benchmarks.watching.rig import clipped, delay, scenario, watched
from monitor.signals.conditions import DEPARTURE, DRY_FRICTION, OTHER_FAULT, STICTION
from sim_plant.effects import EFFECTS, Effect
from sim_plant.scenario import Event, Scenario
from tools.benchmark_table import Row

ONSET, LENGTH = 3.0, 10.0
EXCITATIONS = (2, 3, 4, 5, 6, 7)
STRENGTHS = (0.5, 1.0, 2.0)
"""Shares of an effect's typical strength."""
_LIMITS = ("saturation", "rate_limit")


@dataclass(frozen=True)
class Case:
    """One fault under one excitation, and the monitor's result.

    `alarmed` is a departure or a clipped channel; the verdict names the departure.
    """

    effect: str
    dry: bool
    test: int
    strength: float
    alarmed: bool
    verdict: str
    clipped: bool


def value_of(effect: Effect, strength: float) -> float:
    """The effect at a share of its typical strength; limits are the stronger the lower they are."""
    if effect.name.endswith(_LIMITS):
        return effect.typical / strength
    return effect.neutral + (effect.typical - effect.neutral) * strength


def faulty(effect: Effect, test: int, strength: float) -> Scenario:
    """The excitation of an experiment with one effect from ONSET on."""
    events = [Event(at_s=ONSET, effect=effect.name, value=value_of(effect, strength))]
    events += [Event(at_s=ONSET, effect=name, value=value) for name, value in effect.needs]
    return structs.replace(
        scenario(f"experiment_{test}").healthy(LENGTH), name=effect.name, events=tuple(events)
    )


def judged(effect: Effect, test: int, strength: float, seed: int) -> Case:
    """One case run through the monitor."""
    results = watched(faulty(effect, test, strength), seed)
    named = {name: delay(results, name, ONSET) for name in (DRY_FRICTION, STICTION, OTHER_FAULT)}
    verdict = next((name for name, when in named.items() if when is not None), "not named")
    cut_off = clipped(results, ONSET)
    alarmed = cut_off or delay(results, DEPARTURE, ONSET) is not None
    return Case(effect.name, effect.dry, test, strength, alarmed, verdict, cut_off)


def visible(effect: Effect, test: int, strength: float) -> bool:
    """False where a limit lies above what the excitation reaches, so that nothing changes."""
    drive = scenario(f"experiment_{test}").excitation
    amplitude, frequency = getattr(drive, "amplitude", 0.0), getattr(drive, "frequency", 0.0)
    value = value_of(effect, strength)
    if effect.name.endswith("rate_limit"):
        slope = {"sine": 6.28, "triangle": 4.0, "square": 1e3}[type(drive).__name__.lower()]
        return value < slope * amplitude * frequency
    if effect.name in {"actuator_saturation", "voltage_saturation"}:
        return value < amplitude
    if effect.name == "acceleration_saturation":
        return value < (4.5 if frequency < 8.0 else 12.0)
    return True


def cases(quick: bool) -> list[Case]:
    """All of them; the combinations in which nothing can change are left out."""
    tests, strengths = ((2, 5), (1.0,)) if quick else (EXCITATIONS, STRENGTHS)
    found = []
    for number, effect in enumerate(EFFECTS.values()):
        for test in tests:
            for strength in strengths:
                allowed = effect.low <= value_of(effect, strength) <= effect.high
                if allowed and visible(effect, test, strength):
                    found.append(judged(effect, test, strength, 8000 + number))
    return found


def run(quick: bool) -> list[Row]:
    """Two rows for the bar, then one line of the confusion matrix for each kind."""
    found = cases(quick)
    others = [case for case in found if not case.dry]
    kinds = {case.effect for case in others}
    wrong = [case for case in others if case.verdict in {DRY_FRICTION, STICTION}]
    silent = [case for case in others if not case.alarmed]
    rows = [
        Row(
            f"other faults: {len(kinds)} kinds, {len(others)} runs, alarmed",
            f"{len(others) - len(silent)} of {len(others)}",
            "all",
            "",
            _listed(silent),
            passed=not silent,
        ),
        Row(
            "other faults called dry friction or stiction",
            f"{len(wrong)} of {len(others)}",
            "0",
            "",
            _listed(wrong),
            passed=not wrong,
        ),
    ]
    return rows + [_matrix_row(name, found) for name in dict.fromkeys(c.effect for c in found)]


def _listed(found: list[Case]) -> str:
    return "; ".join(f"{c.effect} x{c.strength:g} in experiment {c.test}" for c in found)


def _matrix_row(name: str, found: list[Case]) -> Row:
    mine = [case for case in found if case.effect == name]
    counts = Counter(case.verdict for case in mine)
    cut_off = sum(case.clipped for case in mine)
    truth = "dry friction" if mine[0].dry else "other"
    return Row(
        f"confusion: {name} ({truth})",
        ", ".join(f"{verdict} {count}" for verdict, count in counts.most_common()),
        "",
        "",
        f"said to be clipped: {cut_off} of {len(mine)}" if cut_off else "",
        passed=None,
    )
