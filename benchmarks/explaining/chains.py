"""Chains: several effects hidden at once in six kinds of machine, found step by step.

A user's work is simulated: the log is imported as a study and explained, the effect named is added,
and this is repeated until nothing is missing. If rivals are named and a hidden effect is among
them, the hidden effect is added, as the user's next experiment would decide. Steps are classified
as in `sim_plant/machines/answers.py`.

    python -m benchmarks chains --quick
    python -m benchmarks.explaining.chains --results chains.jsonl --machine motor --minutes 10

Machines are `sim_plant.machines`, which share no equations with the models. The probability of
a wrong verdict is calibrated on all machines except the one judged.
"""

import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.explaining.chain_rows import Case, Outcome, Step, chain_rows
from benchmarks.explaining.hidden import asked, collected
from benchmarks.explaining.machine_studies import machine_study
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import Ranked
from rigwatch.workbench.steps import accepted_with_model
from rigwatch.workbench.study import Study
from sim_plant.machines import RIGHT, Answer, judged
from tools.benchmark_table import Row, as_text

CHAINS = {
    "oscillator": "coulomb+cubic_stiffness quadratic_drag+dead_band+acceleration_lag",
    "motor": "coulomb+fan saturation+coulomb+drag_by_direction",
    "pendulum": "coulomb+air_drag late_drive+coulomb+imbalance",
    "damper": "slider+hardening joint+orifice+preload",
    "tanks": "leak+dead_band saturation+late_pump+inlet",
    "cascade": "saturation+inlet",
}
"""Effects hidden in each machine at the same time."""
SHARE = 0.1
"""Share of the outputs' rms that each effect changes alone, with exceptions."""
SHARES = {
    "pendulum": {"late_drive": 0.2},
    "tanks": {"leak": 0.3, "dead_band": 0.5, "saturation": 0.3, "late_pump": 0.3, "inlet": 0.3},
    "cascade": {"saturation": 0.3, "inlet": 0.3},
}
NOISES = (0.002, 0.005, 0.02)
"""Standard deviation of the sensors' noise, relative to the rms of their signals."""
SEEDS, FIRST = 5, 101
"""Number of seeds, and the first: the rules of verdicts were chosen on seeds below it."""
MORE = 2
"""Number of steps beyond the hidden effects after which a chain is stopped."""


def cases(*, quick: bool, first: int = FIRST) -> Iterator[Case]:
    """All cases, seed by seed, so that a part of them is a fair sample."""
    for seed in range(first, first + (1 if quick else SEEDS)):
        for noise in NOISES[1:2] if quick else NOISES:
            for machine, chains in CHAINS.items():
                for chain in chains.split():
                    yield Case(machine, tuple(chain.split("+")), noise, seed)


def shares(case: Case) -> dict[str, float]:
    """Share of the outputs' rms that each hidden effect of a case changes."""
    own = SHARES.get(case.machine, {})
    return {name: own.get(name, SHARE) for name in case.hidden}


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
            study = study.with_effects([*study.file.effects, accepted_with_model(chosen)])
        return Outcome(case, tuple(steps))


def _asked(study: Study, machine: str, left: list[str]) -> tuple[Step, Ranked | None]:
    """One step, and the effect that the user adds; effects found are removed from `left`."""
    begin = time.perf_counter()
    rows, verdict = ranking(open_bench(study))
    seconds = time.perf_counter() - begin
    said = Answer(verdict.word, verdict.members, verdict.rivals, verdict.second)
    how_good, found = judged(machine, left, said)
    chosen = None
    if how_good in ("right", "undecided"):
        left.remove(found)
        chosen = _chosen(rows, verdict, RIGHT[machine][found])
    named = (*verdict.members, *verdict.rivals, *(f"+{label}" for label in verdict.second))
    added = chosen.label if chosen else ""
    return Step(how_good, verdict.word, named, added, verdict.evidence, seconds), chosen


def _chosen(rows: Sequence[Ranked], verdict: Verdict, right: Sequence[str]) -> Ranked | None:
    """The effect that the user adds: the one named or, of rivals, the hidden one."""
    true = (row for row in rows if row.label in right and row.fitted is not None)
    confirmed = next(true, None) if verdict.word == "undetermined" else None
    return confirmed or verdict.best


def run(quick: bool) -> list[Row]:
    """Rows of chains found completely, and of wrong verdicts given with confidence."""
    return chain_rows([solve(case) for case in cases(quick=quick)])


def main() -> int:
    """Run cases into a file, one line each; print their table."""
    parser = asked(__doc__)
    parser.add_argument("--machine", action="append", help="this machine alone, may be repeated")
    parser.add_argument("--noise", type=float, action="append", help="this noise alone")
    parser.add_argument("--first", type=int, default=FIRST, help="seed to begin with")
    chosen = parser.parse_args()
    tried = (
        case
        for case in cases(quick=False, first=chosen.first)
        if (not chosen.machine or case.machine in chosen.machine)
        and (not chosen.noise or case.noise in chosen.noise)
        and (not chosen.seed or case.seed in chosen.seed)
        and (not chosen.effect or "+".join(case.hidden) in chosen.effect)
    )
    found = collected(chosen.results, Outcome, tried, solve, said=_line, minutes=chosen.minutes)
    if not found:
        parser.error(f"no case is selected; seeds begin with {chosen.first}, see --first")
    print(as_text(chain_rows(found)))
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
