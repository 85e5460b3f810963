"""Hidden effects on the simulated pneumatic rig: does the workbench name what is missing?

The plant is `sim_plant.rig`: its own code, another integrator and finer steps than the models
compared with it, and sensors with their noise, steps, ranges and a piezo's high-pass. The flow
law of the analytic model was chosen with the plant's in view and is close to it, so these
figures are weak evidence for a real valve.

Each case hides one effect, or two, or none, at a strength that changes an output by a given share
of its rms. The analytic model keeps the parameters of a healthy recording and is fitted to 20 s;
the fourth-order black box is compared with a healthy recording of the same excitation.

    python -m benchmarks hidden_effects_rig --quick
    python -m benchmarks.explaining.hidden_effects_rig --results rig.jsonl --share 0.05 --seed 1

Results are appended to the file one by one; cases already in it are not repeated.
"""

import sys
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from msgspec import structs

from benchmarks.explaining.hidden import asked, collected, confusion, counted, share_row, wanted
from benchmarks.explaining.rig_hidden import (
    ABSORBED,
    BLACK_BOX,
    PERIOD,
    RIG,
    RIGHT,
    UNKNOWN,
    caused,
    recorded,
    settings,
)
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.data.noise.noise_floor import quiet_scale
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.fit.healthy_parameters import with_healthy_parameters
from rigwatch.workbench.fit.healthy_reference import with_healthy_reference
from rigwatch.workbench.ranking.ranked import Ranked, accepted_from
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Span, StudyFile
from tools.benchmark_table import Row, as_text

HORIZON = 128
MODELS = {"analytic": "servo-pneumatic", "black box": "fourth-order"}
SEEDS = 5
HEALTHY = 40
"""Healthy cases of each model."""
PAIRS = (("coulomb", "spring"), ("viscous", "acceleration_lag"), ("cubic_spring", "actuator_delay"))
STRONG = float(np.hypot(1.0, 2.0))
"""Held-out error over the floor if the hidden effect is twice the floor."""
QUICK = ("spring", "acceleration_lag")


@dataclass(frozen=True)
class Case:
    """One rig to be explained.

    Attributes:
        model: key of `MODELS`.
        hidden: effects; none for a healthy rig.
        share: of an output's rms that they change.
        seed: of excitation and noise.
        repeat: number of cases that differ only in noise.
    """

    model: str
    hidden: tuple[str, ...]
    share: float
    seed: int
    repeat: int = 0


@dataclass(frozen=True)
class Outcome:
    """The workbench's result.

    Attributes:
        case: the case.
        word: the verdict.
        first: labels that are named, the best first.
        second: of a second effect.
        rivals: labels that the recording cannot distinguish from the first.
        before, after: held-out error over the floor without and with the best effect.
        caused: change of each output over its floor.
        seconds: of one explanation.
    """

    case: Case
    word: str
    first: tuple[str, ...]
    second: tuple[str, ...]
    rivals: tuple[str, ...]
    before: float
    after: float | None
    caused: tuple[float, ...]
    seconds: float

    @property
    def called(self) -> str:
        """The name given first, or the verdict."""
        return self.first[0] if self.first and self.word != "unknown_effect" else self.word

    @property
    def named(self) -> tuple[str, ...]:
        """The best and all that the recording cannot distinguish from it."""
        return (*self.first, *self.rivals)

    @property
    def right(self) -> bool:
        """Whether the hidden effect is named, first or in the class of the first.

        A verdict of `unknown_effect` names nothing, whatever the best effect was.
        """
        if self.word == "unknown_effect":
            return False
        return any(set(right_for(self.case.model, n)) & set(self.named) for n in self.case.hidden)

    @property
    def sure(self) -> bool:
        """The same, with no effect of other physics in the class."""
        return self.right and not self.rivals

    @property
    def both(self) -> bool:
        """Whether each of two hidden effects is named, first or second."""
        named = {*self.named, *self.second}
        return all(set(right_for(self.case.model, n)) & named for n in self.case.hidden)


def right_for(model: str, name: str) -> tuple[str, ...]:
    """Library names of a hidden effect at the ports of a model."""
    if model == "black box":
        return BLACK_BOX.get(name, RIGHT.get(name, ()))
    return RIGHT.get(name, ())


@cache
def study_of(model: str, seed: int) -> tuple[Study, Recording]:
    """The study with the parameters of the healthy recording, and that recording."""
    span = (Span(session="simulated"),)
    name = MODELS[model]
    file = StudyFile(model=name, train=span, held_out=span, period=PERIOD / RIG.sample_rate)
    bare = Study(Path(), file, shipped_models()[name], library(), frozenset())
    healthy = recorded({}, seed, 100 * seed + 3)
    data = Data(healthy, healthy, healthy, HORIZON, ())
    return with_healthy_parameters(bare, data, quiet_scale(healthy)), healthy


def solve(case: Case) -> Outcome:
    """Simulate a case and explain it."""
    study, healthy = study_of(case.model, case.seed)
    share = case.share / max(np.sqrt(len(case.hidden)), 1.0)
    effects = {name: settings(name, share, case.seed) for name in case.hidden}
    data = simulated(case, effects, healthy)
    begin = time.perf_counter()
    bench, verdict = explained(study, data)
    seconds = time.perf_counter() - begin
    best, second = verdict.best, verdict.second
    if len(case.hidden) == 2 and best is not None and not second:
        second = _named_next(study, data, best)
    after = best.fitted if best else None
    return Outcome(
        case, verdict.word, verdict.members, second, verdict.rivals,
        bench.floor.ratio(bench.base.held_out),
        bench.floor.ratio(after.held_out) if after else None,
        tuple((caused(effects, case.seed) / bench.floor.rms).tolist()), seconds,
    )  # fmt: skip


def simulated(case: Case, effects: Mapping[str, float], healthy: Recording) -> Data:
    """The recordings of a case: fitted to, held out, healthy."""
    # A linear black box is valid for one excitation; the analytic model must be for another.
    other = case.seed if case.model == "black box" else case.seed + 1000
    number = 100 * case.seed + 10 + zlib.crc32(repr(case).encode()) % 50
    return Data(
        recorded(effects, case.seed, number), recorded(effects, other, number + 5000),
        healthy, HORIZON, (),
    )  # fmt: skip


def explained(study: Study, data: Data) -> tuple[Bench, Verdict]:
    """The workbench's steps without its files; the healthy recording has been read before."""
    scale = quiet_scale(data.train)
    study, data = with_healthy_reference(study, data, scale)
    bench = bench_of(study, data, scale)
    return bench, ranking(bench)[1]


def _named_next(study: Study, data: Data, best: Ranked) -> tuple[str, ...]:
    """Labels named after the best has been added."""
    file = structs.replace(study.file, effects=(accepted_from(best),))
    _, verdict = explained(replace(study, file=file), data)
    return (*verdict.members, *verdict.rivals)


def cases(quick: bool) -> Iterator[Case]:
    """The cases, most important strengths first."""
    for seed in range(1, 2 if quick else SEEDS + 1):
        for share in (0.05,) if quick else (0.05, 0.02, 0.1, 0.01, 0.005):
            for model in MODELS:
                for name in QUICK if quick else (*RIGHT, *ABSORBED):
                    yield Case(model, (name,), share, seed)
                if share == 0.05 and not quick:
                    yield from (Case(model, (name,), share, seed) for name in UNKNOWN)
                    yield from (Case(model, pair, share, seed) for pair in PAIRS)
                    each = range(HEALTHY // SEEDS)
                    yield from (Case(model, (), 0.0, seed, k) for k in each)
    if quick:
        yield from (Case(model, (), 0.0, 1) for model in MODELS)


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    return rows_of([solve(case) for case in cases(quick)])


def rows_of(outcomes: Sequence[Outcome]) -> list[Row]:
    """Rows of both models."""
    return [row for model in MODELS for row in _rows(model, outcomes)]


def _rows(model: str, every: Sequence[Outcome]) -> list[Row]:
    outcomes = [o for o in every if o.case.model == model]
    single = [o for o in outcomes if len(o.case.hidden) == 1 and right_for(model, o.case.hidden[0])]
    listed = [o for o in single if o.case.share >= 0.01 and max(o.caused) >= 2]
    strong = [o for o in listed if o.before >= STRONG]
    faint = [o for o in listed if o.before < STRONG]
    absorbed = [o for o in outcomes if o.case.hidden and o.case.hidden[0] in ABSORBED]
    unknown = [o for o in outcomes if o.case.hidden and o.case.hidden[0] in UNKNOWN]
    pairs = [o for o in outcomes if len(o.case.hidden) == 2]
    healthy = [o for o in outcomes if not o.case.hidden]
    lagging = [o for o in strong if o.case.hidden[0].startswith("acceleration_l")]
    after = [o.after for o in strong if o.right and o.after is not None]
    error = float(np.median(after)) if after else None
    seconds = float(np.median([o.seconds for o in outcomes])) if outcomes else None
    start = f"rig, {model}:"
    return [
        share_row(f"{start} right effect or class first, from 1 % and twice the floor",
                  [o.right for o in strong], 0.97, _mistaken(strong)),
        share_row(f"{start} the same without effects of other physics in the class",
                  [o.sure for o in strong], None, ""),
        share_row(f"{start} the same where the fit leaves less than twice the floor",
                  [o.right for o in faint], None, _mistaken(faint)),
        share_row(f"{start} absorbed by the fitted zero of the valve: nothing_missing",
                  [o.word == "nothing_missing" for o in absorbed], None,
                  counted(f"{o.case.hidden[0]} as {o.called}" for o in absorbed)),
        share_row(f"{start} class of at most 3", [len(o.named) <= 3 for o in strong], 0.9,
                  counted(o.case.hidden[0] for o in strong if len(o.named) > 3)),
        share_row(f"{start} accelerometer's lag named as such", [o.right for o in lagging], 0.95,
                  _mistaken(lagging)),
        share_row(f"{start} healthy not called missing_effect",
                  [o.word != "missing_effect" for o in healthy], 0.99,
                  counted(o.called for o in healthy)),
        share_row(f"{start} outside the library: unknown_effect",
                  [o.word == "unknown_effect" for o in unknown], 0.95,
                  counted(f"{o.case.hidden[0]} as {o.called}" for o in unknown)),
        share_row(f"{start} two effects at once, both named in two steps",
                  [o.both for o in pairs], 0.9,
                  counted(f"{'+'.join(o.case.hidden)} as {o.called}" for o in pairs if not o.both)),
        Row(f"{start} held-out error over floor with the right effect, median",
            "-" if error is None else f"{error:.3f}", "≤ 1.10", "", "",
            None if error is None else error <= 1.1),
        Row(f"{start} one explain with refits, median",
            "-" if seconds is None else f"{seconds:.1f} s", "10 s", "", "",
            None if seconds is None else seconds <= 10),
    ]  # fmt: skip


def _mistaken(outcomes: Iterable[Outcome]) -> str:
    """Wrong names by hidden effect, the most frequent first."""
    return counted(f"{o.case.hidden[0]} as {o.called}" for o in outcomes if not o.right)


def main() -> int:
    """Run cases into a file, one line each; print their table."""
    parser = asked(__doc__)
    parser.add_argument("--model", choices=list(MODELS), help="one model, default both")
    chosen = parser.parse_args()
    tried = (
        case
        for case in cases(quick=False)
        if wanted(case, chosen) and chosen.model in (None, case.model)
    )
    found = collected(chosen.results, Outcome, tried, solve, said=_line, minutes=chosen.minutes)
    print(as_text(rows_of(found)))
    for model in MODELS:
        print(f"\n{model}:")
        print(confusion((o.case.hidden, o.called) for o in found if o.case.model == model))
    return 0


def _line(o: Outcome) -> str:
    after = f" → {o.after:.2f}" if o.after else ""
    return (
        f"{o.case.model} {'+'.join(o.case.hidden) or 'healthy'} {o.case.share:g} {o.case.seed}:"
        f" {o.word} {', '.join(o.first)} | {', '.join(o.second)} | {', '.join(o.rivals)};"
        f" {o.before:.2f}{after}, caused {max(o.caused):.1f}, {o.seconds:.1f} s"
    )


if __name__ == "__main__":
    sys.exit(main())
