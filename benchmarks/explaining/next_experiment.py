"""Proposed experiments, run: does a recording that could not decide give one that does?

`sim_plant.oscillator` hides an effect while one sine drives it, which leaves rivals. The
proposed experiment is then run on the same plant, and explained.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.explaining.hidden_effects import RIGHT, SAMPLES, explained
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.experiment.next_experiment import excitation
from rigwatch.workbench.explain.explanation import explanation
from sim_plant.oscillator import RATE, Hidden, strength_for
from tests.workbench.simulated import HORIZON, recorded, size_of, study
from tools.benchmark_table import Row

NOISE = 0.02
"""Standard deviation of the sensors' noise, relative to the rms of their signals under the sine."""
TRIED = (
    "coulomb", "stribeck", "dahl", "quadratic_drag", "cubic_stiffness", "quadratic_stiffness",
    "hard_stop", "backlash", "bouc_wen", "viscous_by_direction", "dead_band", "saturation",
    "valve_hysteresis", "delay", "acceleration_lag",
)  # fmt: skip
Force = NDArray[np.float64]


@dataclass(frozen=True)
class Decided:
    """One case.

    Attributes:
        hidden: the hidden effect, and the sine's frequency [Hz].
        rivals: effects that the first recording could not distinguish from the best.
        proposal: the proposed excitation, empty if there was none.
        after: verdict of the second recording.
        right: whether it names the hidden effect.
    """

    hidden: str
    rivals: tuple[str, ...]
    proposal: str
    after: str
    right: bool


def decide(name: str, frequency: float, share: float, seed: int = 3) -> Decided | None:
    """Explain, propose, run, explain; None if the first recording leaves no rivals."""
    time = np.arange(SAMPLES) / RATE
    force = 4 * np.sin(2 * np.pi * frequency * time)
    noise = NOISE * size_of(force)
    hidden = (Hidden(name, strength_for(name, force, share)),)
    bench, rows, verdict = explained(study(), _recorded(force, hidden, noise, seed))
    if verdict.word != "undetermined":
        return None
    what, proposed = f"{name} at {frequency:g} Hz", explanation(bench, rows, verdict)
    if proposed.next_experiment is None:
        return Decided(what, verdict.rivals, "", "nothing proposed", right=False)
    again = excitation(bench, proposed.next_experiment)[:, 0]
    _, _, after = explained(study(), _recorded(again, hidden, noise, seed + 10))
    named = set(after.members) & set(RIGHT[name])
    right = after.word == "missing_effect" and bool(named)
    return Decided(what, verdict.rivals, proposed.next_experiment.shape, after.word, right)


def _recorded(force: Force, hidden: tuple[Hidden, ...], noise: Force, seed: int) -> Data:
    made = [
        recorded(force, effects, noise, seed + 50 * k)
        for k, effects in enumerate((hidden, hidden, ()))
    ]
    return Data(made[0], made[1], made[2], HORIZON, ())


def cases(quick: bool) -> Iterator[tuple[str, float, float]]:
    """Effects, frequencies of the sine [Hz] and shares of the outputs that they change."""
    if quick:
        yield "quadratic_stiffness", 3.0, 0.02
        return
    yield from ((name, frequency, 0.02) for name in TRIED for frequency in (1.5, 3.0, 5.0))


def run(quick: bool) -> list[Row]:
    """One row a case that was undetermined, and one for all."""
    tried = [decide(*case) for case in cases(quick)]
    found = [case for case in tried if case is not None]
    right = sum(case.right for case in found)
    rows = [
        Row(
            "undetermined recordings that the proposed experiment decides rightly",
            f"{right} of {len(found)}", "all", "",
            f"{len(tried) - len(found)} of {len(tried)} recordings were decided at once",
            passed=right == len(found) if found else None,
        )
    ]  # fmt: skip
    return rows + [
        Row(
            f"{case.hidden}, rivals {', '.join(case.rivals)}",
            case.after, "missing_effect", "", case.proposal, passed=case.right,
        )
        for case in found
    ]  # fmt: skip
