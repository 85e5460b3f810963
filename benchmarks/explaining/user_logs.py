"""First verdicts on logs with lost rows, uneven times and clocks of their own, on six machines.

A single effect, or none, is hidden in a machine of `sim_plant.machines`; its logs are written as
loggers do (`sim_plant/machines/loggers.py`), imported, and explained once. Verdicts on such logs
are counted apart from those on faultless ones, by word.

    python -m benchmarks.explaining.user_logs --results logs.jsonl --minutes 10
    python -m benchmarks.explaining.user_logs --results logs.jsonl --calibrate

Each machine's verdicts are compared with what those of all machines of other equations promise.
"""

import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.explaining.chain_rows import most_by_chance
from benchmarks.explaining.chains import SHARE, SHARES
from benchmarks.explaining.hidden import asked, collected, counted
from benchmarks.explaining.machine_studies import machine_study
from rigwatch.workbench.compare import open_bench
from rigwatch.workbench.explain import verdict_calibration
from rigwatch.workbench.explain.adequacy import SHORT
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.verdict_calibration import Evidence
from sim_plant.machines import MACHINES, RIGHT, Answer, judged
from sim_plant.machines.loggers import LOGGERS
from tools.benchmark_table import Row, as_text

NOISES = (0.002, 0.005, 0.02)
"""Standard deviation of the sensors' noise, relative to the rms of their signals, seed by seed."""
FIRST, SEEDS = 1001, 6
"""The first seed, and their number."""
TOLD = ("missing_effect", "nothing_missing", "undetermined", "unknown_effect")
"""Verdicts that are right or wrong."""
HEALTHY = 3
"""Recordings with nothing hidden for each logger, machine and seed."""


@dataclass(frozen=True)
class Case:
    """One machine and its logger.

    Attributes:
        machine: its name.
        hidden: name of the hidden effect; none for a healthy machine.
        noise: of the sensors, relative to the rms of their signals.
        seed: of the recordings.
        logger: what it does to the log.
    """

    machine: str
    hidden: tuple[str, ...]
    noise: float
    seed: int
    logger: str


@dataclass(frozen=True)
class Outcome:
    """The verdict on a case, and its classification by `sim_plant.machines.judged`."""

    case: Case
    judged: str
    word: str
    named: tuple[str, ...]
    evidence: Evidence
    seconds: float

    @property
    def wrong(self) -> bool:
        """Whether the verdict is wrong, as `Outcome.wrong` of `hidden_effects` counts it."""
        match self.word:
            case "unknown_effect":
                return not self.case.hidden or bool(RIGHT[self.case.machine][self.case.hidden[0]])
            case "model_inadequate":
                return not self.named and self.judged == "more"
            case _:
                return self.judged in ("wrong", "astray", "more")


def cases(*, quick: bool) -> Iterator[Case]:
    """All cases, seed by seed, so that a part of them is a fair sample."""
    for seed in range(FIRST, FIRST + (1 if quick else SEEDS)):
        noise = NOISES[seed % len(NOISES)]
        for name, machine in MACHINES.items():
            for logger in LOGGERS if machine.any_clock else LOGGERS[:1]:
                for effect in list(RIGHT[name])[: 1 if quick else None]:
                    yield Case(name, (effect,), noise, seed, logger)
                for more in range(1 if quick else HEALTHY):
                    yield Case(name, (), noise, seed + 100 * more, logger)


def solve(case: Case) -> Outcome:
    """Simulate a case and explain it once."""
    shares = {name: SHARES.get(case.machine, {}).get(name, SHARE) for name in case.hidden}
    with tempfile.TemporaryDirectory() as folder:
        given = (case.machine, shares, case.noise, case.seed, case.logger)
        study = machine_study(Path(folder), *given)
        begin = time.perf_counter()
        _, verdict = ranking(open_bench(study))
        seconds = time.perf_counter() - begin
    said = Answer(verdict.word, verdict.members, verdict.rivals, verdict.second)
    how_good, _ = judged(case.machine, case.hidden, said)
    named = (*verdict.members, *verdict.rivals, *(f"+{label}" for label in verdict.second))
    return Outcome(case, how_good, verdict.word, named, verdict.evidence, seconds)


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    return rows_of([solve(case) for case in cases(quick=quick)])


def rows_of(outcomes: Sequence[Outcome]) -> list[Row]:
    """Verdicts by word, and wrong ones promised by other machines and found."""
    rows = []
    for word in sorted({o.word for o in outcomes}):
        own = [o for o in outcomes if o.word == word]
        wrong = [o for o in own if o.wrong]
        note = counted(f"{'+'.join(o.case.hidden) or 'healthy'} {o.case.logger}" for o in wrong)
        what = f"logs of real loggers: {word}, wrong"
        rows.append(Row(what, f"{len(wrong)} of {len(own)}", "", "", note, None))
    for machine in dict.fromkeys(o.case.machine for o in outcomes):
        others = counts([o for o in outcomes if o.case.machine != machine])
        own = [o for o in outcomes if o.case.machine == machine]
        rows += [
            _promised(machine, [o for o in own if o.word in words], others)
            for words in (("missing_effect",), TOLD)
        ]
    return rows


def _promised(machine: str, own: Sequence[Outcome], others: dict[str, tuple[int, int]]) -> Row:
    """Wrong verdicts on a machine, as promised by the others and found."""
    doubts = [(wrong + 1) / (of + 2) for o in own for of, wrong in [others.get(o.word, (0, 0))]]
    found, most = sum(o.wrong for o in own), most_by_chance(doubts)
    plant = MACHINES[machine]
    short = len(plant.run(plant.drive(FIRST), {})) < SHORT
    words = "an effect named" if {o.word for o in own} <= {"missing_effect"} else "any verdict"
    return Row(
        f"the same on {machine}, as the other machines promise: {words}",
        f"{found} of {len(own)}, {sum(doubts):.1f} promised", f"≤ {most}", "",
        f"no probability is stated: fewer than {SHORT} samples" if short else "",
        None if short else found <= most,
    )  # fmt: skip


def counts(outcomes: Sequence[Outcome]) -> dict[str, tuple[int, int]]:
    """Number of verdicts by word, and how many were wrong."""
    found: dict[str, tuple[int, int]] = {}
    for outcome in outcomes:
        of, wrong = found.get(outcome.word, (0, 0))
        found[outcome.word] = of + 1, wrong + outcome.wrong
    return found


def calibrated(outcomes: Sequence[Outcome]) -> str:
    """The text of the workbench's file of counts."""
    lines = ["# Written by `python -m benchmarks.explaining.user_logs --calibrate`: first verdicts"]
    lines += ["# on simulated machines whose logs have lost rows, uneven times or other clocks."]
    for word, (of, wrong) in sorted(counts(outcomes).items()):
        lines += ["", "[[cells]]", f'word = "{word}"', f"cases = {of}", f"wrong = {wrong}"]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run cases into a file, one line each; print their table."""
    parser = asked(__doc__)
    parser.add_argument("--calibrate", action="store_true", help="write the file of counts")
    parser.add_argument("--machine", action="append", help="this machine alone, may be repeated")
    chosen = parser.parse_args()
    tried = (
        case
        for case in cases(quick=False)
        if (not chosen.machine or case.machine in chosen.machine)
        and (not chosen.effect or (*case.hidden, "healthy")[0] in chosen.effect)
        and (not chosen.seed or case.seed in chosen.seed)
    )
    given = () if chosen.calibrate else tried
    found = collected(chosen.results, Outcome, given, solve, said=_line, minutes=chosen.minutes)
    if chosen.calibrate:
        path = Path(verdict_calibration.__file__).with_name(verdict_calibration.LOGGED_FILE)
        path.write_text(calibrated(found), encoding="utf-8")
    print(as_text(rows_of(found)))
    return 0


def _line(o: Outcome) -> str:
    return (
        f"{'WRONG' if o.wrong else '     '} {o.case.machine} {'+'.join(o.case.hidden) or 'healthy'}"
        f" {o.case.logger} {o.case.noise:g} {o.case.seed}: {o.judged}, {o.word}"
        f" {', '.join(o.named[:4])} (left {o.evidence.left:.2f}, {o.seconds:.0f} s)"
    )


if __name__ == "__main__":
    sys.exit(main())
