"""Chains: several effects hidden at once in five kinds of machine, found step by step.

What a user does is played: the log becomes a study, the workbench is asked, what it names is added,
it is asked again, until it says that nothing is missing. Where it cannot tell rivals apart and the
truth is among them, the user's next experiment tells, so the truth is added. Each step is judged:

    right       what is named is hidden and not found yet, or cannot be told from what is
    undecided   rivals are named, the truth among them
    unknown     no known effect explains the error: nothing is named
    astray      rivals are named, the truth not among them
    wrong       with confidence: an effect that is not there, or nothing missing where more is

    python -m benchmarks.explaining.chains --quick
    python -m benchmarks.explaining.chains --results chains.jsonl --machine motor --minutes 10

Machines are `sim_plant.machines`, which share no equations with the models. How often a verdict is
wrong is calibrated on the other machines than the one that it is judged on.
"""

import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.explaining.hidden import asked, collected, share_row
from benchmarks.explaining.machine_studies import RIGHT, machine_study
from benchmarks.table import Row, as_text
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.explain.verdict_calibration import LEANING, Evidence, cell_of
from rigwatch.workbench.ranking import Ranked
from rigwatch.workbench.steps import whole
from rigwatch.workbench.study import Study

CHAINS: dict[str, tuple[tuple[tuple[str, float], ...], ...]] = {
    "oscillator": (
        (("coulomb", 0.1), ("cubic_stiffness", 0.1)),
        (("quadratic_drag", 0.1), ("dead_band", 0.1), ("acceleration_lag", 0.1)),
    ),
    "motor": (
        (("coulomb", 0.1), ("fan", 0.1)),
        (("saturation", 0.1), ("coulomb", 0.1), ("drag_by_direction", 0.1)),
    ),
    "pendulum": (
        (("coulomb", 0.1), ("air_drag", 0.1)),
        (("late_drive", 0.2), ("coulomb", 0.1), ("imbalance", 0.1)),
    ),
    "damper": (
        (("slider", 0.1), ("hardening", 0.1)),
        (("joint", 0.1), ("orifice", 0.1), ("preload", 0.1)),
    ),
    "tanks": (
        (("leak", 0.3), ("dead_band", 0.5)),
        (("saturation", 0.3), ("late_pump", 0.3), ("inlet", 0.3)),
    ),
}
"""What is hidden in each machine at once, and by what share it changes the outputs alone."""
NOISES = (0.002, 0.005, 0.02)
"""Standard deviation of the sensors' noise over the rms of what they read."""
SEEDS = 5
MORE = 2
"""Steps beyond the hidden effects after which a chain is broken off."""
CONFIDENT = 0.05
"""Probability of being wrong up to which a verdict counts as given with confidence."""


@dataclass(frozen=True)
class Case:
    """One machine with a chain hidden in it.

    Attributes:
        machine: its name.
        hidden: names of what is hidden.
        noise: of the sensors, over the rms of what they read.
        seed: of excitation and noise.
    """

    machine: str
    hidden: tuple[str, ...]
    noise: float
    seed: int


@dataclass(frozen=True)
class Step:
    """One question and its answer.

    Attributes:
        judged: right, undecided, unknown, astray or wrong; "ended" or "more" once all are found.
        word: the verdict.
        named: labels that are named, the best first.
        added: what the user added.
        evidence: what the verdict rests on.
        seconds: of one explanation.
    """

    judged: str
    word: str
    named: tuple[str, ...]
    added: str
    evidence: Evidence
    seconds: float


@dataclass(frozen=True)
class Outcome:
    """A chain, step by step."""

    case: Case
    steps: tuple[Step, ...] = field(default_factory=tuple)

    @property
    def good(self) -> bool:
        """Whether each step was right or honestly undecided until all was found."""
        on_the_way = [step for step in self.steps if step.judged not in ("ended", "more")]
        return self.complete and all(s.judged in ("right", "undecided") for s in on_the_way)

    @property
    def complete(self) -> bool:
        """Whether all that is hidden was found."""
        return self.steps[-1].judged in ("ended", "more")


def cases(*, quick: bool) -> Iterator[Case]:
    """All cases, seed by seed, so that a part of them is a fair sample."""
    for seed in range(1, 2 if quick else SEEDS + 1):
        for noise in NOISES[1:2] if quick else NOISES:
            for machine, chains in CHAINS.items():
                for chain in chains:
                    yield Case(machine, tuple(name for name, _ in chain), noise, seed)


def shares(case: Case) -> dict[str, float]:
    """What share each hidden effect of a case changes the outputs by."""
    every = (dict(chain) for chain in CHAINS[case.machine])
    return next(chain for chain in every if tuple(chain) == case.hidden)


def solve(case: Case) -> Outcome:
    """Hide a chain in a machine and find it again, step by step."""
    with tempfile.TemporaryDirectory() as folder:
        study = machine_study(Path(folder), case.machine, shares(case), case.noise, case.seed)
        left, steps = list(case.hidden), list[Step]()
        while len(steps) < len(case.hidden) + MORE:
            step, chosen = _asked(study, case.machine, left)
            steps.append(step)
            if chosen is None:
                break
            study = study.with_effects([*study.file.effects, whole(chosen)])
        return Outcome(case, tuple(steps))


def _asked(study: Study, machine: str, left: list[str]) -> tuple[Step, Ranked | None]:
    """One step, and what the user adds; what is found is no longer left."""
    begin = time.perf_counter()
    rows, verdict = ranking(open_bench(study))
    seconds = time.perf_counter() - begin
    judged, found = judged_step(machine, left, verdict)
    chosen = None
    if judged in ("right", "undecided"):
        left.remove(found)
        chosen = _chosen(rows, verdict, RIGHT[machine][found])
    named = (*verdict.members, *verdict.rivals, *(f"+{label}" for label in verdict.second))
    added = chosen.label if chosen else ""
    return Step(judged, verdict.word, named, added, verdict.evidence, seconds), chosen


def judged_step(machine: str, left: Sequence[str], verdict: Verdict) -> tuple[str, str]:
    """How good a verdict is where `left` is still hidden, and which of it is found."""
    if not left:
        return ("ended" if verdict.word == "nothing_missing" else "more"), ""
    named = {"missing_effect": verdict.members, "undetermined": verdict.members + verdict.rivals}
    labels = set(named.get(verdict.word, ()))
    found = next((name for name in left if labels & set(RIGHT[machine][name])), "")
    others = [name for name in left if name != found]
    beside = any(set(verdict.second) & set(RIGHT[machine][name]) for name in others)
    true = bool(found) and (beside or not verdict.second)
    match verdict.word:
        case "missing_effect":
            return ("right" if true else "wrong"), found
        case "undetermined":
            return ("undecided" if true else "astray"), found
        case "nothing_missing":
            return "wrong", ""
        case _:
            return "unknown", ""


def _chosen(rows: Sequence[Ranked], verdict: Verdict, right: Sequence[str]) -> Ranked | None:
    """What the user adds: what is named, or of rivals the one that the next experiment confirms."""
    true = (row for row in rows if row.label in right and row.fitted is not None)
    confirmed = next(true, None) if verdict.word == "undetermined" else None
    return confirmed or verdict.best


def run(quick: bool) -> list[Row]:
    """Chains found again, and what was said with confidence and was wrong."""
    return rows_of([solve(case) for case in cases(quick=quick)])


def rows_of(outcomes: Sequence[Outcome]) -> list[Row]:
    """The rows of the table."""
    steps = [s for o in outcomes for s in o.steps if s.judged not in ("ended", "more")]
    ends = [o.steps[-1].judged == "ended" for o in outcomes if o.complete and o.good]
    wrong = [step.judged == "wrong" for step in steps]
    counts = Counter(step.judged for step in steps)
    seconds = sorted(s.seconds for o in outcomes for s in o.steps)
    return [
        share_row("chains: every step right or honestly undetermined",
                  [o.good for o in outcomes], 0.9, _parts(outcomes)),
        Row("chains: steps wrong with confidence", f"{sum(wrong)}/{len(wrong)}"
            f" = {sum(wrong) / max(len(wrong), 1):.1%}", "≤ 2%", "",
            ", ".join(f"{word}: {count}" for word, count in counts.most_common()),
            sum(wrong) <= 0.02 * len(wrong)),
        share_row("chains: nothing missing after the last right step", ends, 0.95, ""),
        *_left_out(outcomes),
        Row("chains: one explanation, median", f"{seconds[len(seconds) // 2]:.1f} s", "", "", "",
            None),
    ]  # fmt: skip


def _parts(outcomes: Sequence[Outcome]) -> str:
    """Good chains by machine and by noise."""

    def part(name: str, chosen: Sequence[Outcome]) -> str:
        return f"{name} {sum(o.good for o in chosen)}/{len(chosen)}"

    machines = dict.fromkeys(o.case.machine for o in outcomes)
    noises = sorted({o.case.noise for o in outcomes})
    return ", ".join([
        *(part(m, [o for o in outcomes if o.case.machine == m]) for m in machines),
        *(part(f"noise {n:.1%}", [o for o in outcomes if o.case.noise == n]) for n in noises),
    ])  # fmt: skip


def _left_out(outcomes: Sequence[Outcome]) -> list[Row]:
    """Wrong verdicts as the other machines promise them and as they came."""
    rows = []
    for machine in dict.fromkeys(o.case.machine for o in outcomes):
        told = _named_steps([o for o in outcomes if o.case.machine != machine])
        own = _named_steps([o for o in outcomes if o.case.machine == machine])
        doubts = [_doubt(step, told) for step in own]
        sure = [s for s, doubt in zip(own, doubts, strict=True) if doubt <= CONFIDENT]
        rows.append(Row(
            f"chains: wrong verdicts on {machine}, promised by the others and found",
            f"{sum(doubts):.1f} and {sum(_is_wrong(s) for s in own)} of {len(own)}", "", "",
            f"of {len(sure)} with at most {CONFIDENT:.0%} promised"
            f" {sum(map(_is_wrong, sure))} wrong", None,
        ))  # fmt: skip
    return rows


def _named_steps(outcomes: Sequence[Outcome]) -> list[Step]:
    return [step for outcome in outcomes for step in outcome.steps]


def _is_wrong(step: Step) -> bool:
    return step.judged in ("wrong", "astray", "more")


def _doubt(step: Step, told: Sequence[Step]) -> float:
    """Probability that a verdict is wrong, as counted on steps of other machines."""
    same = [s for s in told if s.word == step.word]
    rate = (sum(map(_is_wrong, same)) + 1) / (len(same) + 2)
    cell = cell_of(step.word, step.evidence)
    alike = [s for s in same if cell_of(s.word, s.evidence) == cell]
    return (sum(map(_is_wrong, alike)) + LEANING * rate) / (len(alike) + LEANING)


def main() -> int:
    """Run cases into a file, one line each; print the table of what it holds."""
    parser = asked(__doc__)
    parser.add_argument("--machine", action="append", help="this machine alone, may be repeated")
    parser.add_argument("--noise", type=float, action="append", help="this noise alone")
    chosen = parser.parse_args()
    tried = (
        case
        for case in cases(quick=False)
        if (not chosen.machine or case.machine in chosen.machine)
        and (not chosen.noise or case.noise in chosen.noise)
        and (not chosen.seed or case.seed in chosen.seed)
        and (not chosen.effect or "+".join(case.hidden) in chosen.effect)
    )
    found = collected(chosen.results, Outcome, tried, solve, said=_line, minutes=chosen.minutes)
    print(as_text(rows_of(found)))
    return 0


def _line(o: Outcome) -> str:
    mark = "     " if o.good else "MISS "
    told = "; ".join(
        f"{s.judged}: {s.word} {', '.join(s.named[:4])}"
        f" (left {s.evidence.left:.2f}, {s.seconds:.0f} s) → {s.added}"
        for s in o.steps
    )
    return (
        f"{mark}{o.case.machine} {'+'.join(o.case.hidden)} {o.case.noise:g} {o.case.seed}: {told}"
    )


if __name__ == "__main__":
    sys.exit(main())
