"""Hidden effects, simulated: does the workbench name what is missing?

The plant is `sim_plant.oscillator`, which shares no equations with the engine. Each case hides one
effect, or two, or none, at a strength that changes an output by a given share of its rms; the
model is fitted to one recording of 20 s, judged on another, and a healthy recording with another
excitation gives the noise floor. Two hidden effects are found in two steps: the effect named first
is added, and the study is explained again.

    python -m benchmarks hidden_effects --quick
    python -m benchmarks.explaining.hidden_effects --results msd.jsonl --seed 10 --share 0.05
    python -m benchmarks.explaining.hidden_effects --results msd.jsonl --calibrate

Results are appended to the file one by one; cases already in it are not repeated. The verdicts of
seeds below `JUDGED` make the calibration of the workbench, the others test it.
"""

import sys
import time
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.explaining.hidden import asked, collected, confusion, counted, share_row, wanted
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import Bench, bench_of
from rigwatch.workbench.compare.uncertainty_budget import added_variances
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.explain import verdict_calibration as calibration
from rigwatch.workbench.explain.explain import ranking
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.explain.verdict_calibration import Evidence, cell_of
from rigwatch.workbench.fit.intervals import values
from rigwatch.workbench.ranking.ranked import Ranked, accepted_from
from rigwatch.workbench.study.study import Study
from sim_plant.oscillator import (
    DAMPING,
    DIGITAL,
    MASS,
    STIFFNESS,
    UNKNOWN,
    Hidden,
    strength_for,
)
from tests.workbench.simulated import HORIZON, multisine, recorded, size_of, study
from tools.benchmark_table import Row, as_text

SAMPLES = 5120
NOISE = 2e-3
"""Standard deviation of the sensors' noise, relative to the rms of their signals."""
RIGHT: dict[str, tuple[str, ...]] = {
    "coulomb": ("coulomb@load",),
    "stribeck": ("stribeck@load",),
    "dahl": ("dahl@load", "bliman_sorine_1@load", "lugre@load"),
    "quadratic_drag": ("quadratic_drag@load",),
    "constant_force": ("constant_force@load", "offset@drive"),
    "cubic_stiffness": ("cubic_stiffness@load",),
    "quadratic_stiffness": ("quadratic_stiffness@load",),
    "hard_stop": ("hard_stop@load",),
    "backlash": ("backlash@load",),
    "bouc_wen": ("bouc_wen@load",),
    "end_binding": ("end_binding@load",),
    "viscous_by_direction": ("viscous_by_direction@load",),
    "dead_band": ("dead_band@drive",),
    "saturation": ("saturation@drive",),
    "valve_hysteresis": ("valve_hysteresis@drive",),
    "delay": ("delay@drive", "lag@drive"),
    "acceleration_lag": ("lag@acceleration_sensor", "delay@acceleration_sensor"),
    "position_lag": ("lag@position_sensor", "delay@position_sensor"),
    "acceleration_gain": ("gain@acceleration_sensor", "gain@position_sensor"),
    "position_offset": ("offset@position_sensor",),
    "position_drift": ("drift@position_sensor",),
    "acceleration_smoothing": ("digital_smoothing@acceleration_sensor",),
    "position_smoothing": ("digital_smoothing@position_sensor",),
    "drive_smoothing": ("digital_smoothing@drive",),
    "acceleration_average": ("moving_average@acceleration_sensor",),
    "position_average": ("moving_average@position_sensor",),
    "drive_average": ("moving_average@drive",),
}
"""Library names of each hidden effect; several if no recording can distinguish them."""
ANALOG = tuple(name for name in RIGHT if name not in DIGITAL)
"""Hidden effects that any plant may have; the others are digital filters."""
EXACT = {
    "coulomb": "Fc", "dahl": "Fc", "quadratic_drag": "b", "cubic_stiffness": "k3",
    "quadratic_stiffness": "k2", "hard_stop": "k", "backlash": "k", "viscous_by_direction": "dd",
    "dead_band": "b", "position_drift": "r", "end_binding": "", "saturation": "",
}  # fmt: skip
"""Effects with which mass, damper and spring keep their meaning, and the name of their own strength
if the library defines it in the same way."""
PAIRS = (
    ("coulomb", "cubic_stiffness"),
    ("quadratic_drag", "constant_force"),
    ("dead_band", "quadratic_stiffness"),
    ("coulomb", "acceleration_lag"),
)
QUICK = ("coulomb", "cubic_stiffness", "acceleration_lag", "dead_band")
SEEDS = 20
HEALTHY = 400
JUDGED = 20
HEALTHY_JUDGED = 5000
"""Seeds below make the calibration of verdicts, the others test it."""
STRONG = float(np.hypot(1.0, 2.0))
"""Error over the floor if the hidden effect, less what the fit absorbs, is twice the floor."""


@dataclass(frozen=True)
class Case:
    """One plant to be explained.

    Attributes:
        hidden: names; none for a healthy plant.
        share: of an output's rms that they change.
        seed: of the excitation; with the rest of the case, of the noise.
        held: whether the force is held between samples; unknown to the workbench.
    """

    hidden: tuple[str, ...]
    share: float
    seed: int
    held: bool = False

    @property
    def judges(self) -> bool:
        """Whether it tests the calibration of verdicts instead of contributing to it."""
        return self.seed >= (JUDGED if self.hidden else HEALTHY_JUDGED)


@dataclass(frozen=True)
class Outcome:
    """The workbench's result.

    Attributes:
        case: the case.
        word: the verdict.
        first: labels that are named, the best first, with all indistinguishable from it.
        second: labels of a second effect: of the same verdict, or of the next step.
        before, after: held-out error over the floor without and with the best effect.
        evidence: the evidence of the verdict.
        covered: intervals that contain the true parameter, and their number.
        seconds: of one explanation.
    """

    case: Case
    word: str
    first: tuple[str, ...]
    second: tuple[str, ...]
    before: float
    after: float | None
    evidence: Evidence
    covered: tuple[int, int]
    seconds: float

    @property
    def called(self) -> str:
        """The name given first, or the verdict."""
        return self.first[0] if self.word in ("missing_effect", "undetermined") else self.word

    @property
    def right(self) -> bool:
        """Whether the hidden effect is named, first or in the class of the first.

        A verdict of `unknown_effect` names nothing, whatever the best effect was.
        """
        if self.word == "unknown_effect":
            return False
        return any(set(RIGHT.get(name, ())) & set(self.first) for name in self.case.hidden)

    @property
    def both(self) -> bool:
        """Whether each of two hidden effects is named, first or second."""
        named = set(self.first) | set(self.second)
        return all(set(RIGHT[name]) & named for name in self.case.hidden)

    @property
    def wrong(self) -> bool:
        """Whether the verdict is wrong."""
        known = [name for name in self.case.hidden if name in RIGHT]
        match self.word:
            case "nothing_missing":
                return bool(self.case.hidden)
            case "unknown_effect":
                return not self.case.hidden or len(known) == 1
            case _:
                return not self.right


def excitation(seed: int) -> FloatArray:
    """Force with lines from 0.25 to 8 Hz, rms 4 N."""
    return multisine(np.arange(0.25, 8, 0.25), 4.0, seed=seed)


def noisy(
    hidden: tuple[Hidden, ...], seed: int, noise: int | None = None, *, held: bool = False
) -> Recording:
    """One recording of the plant.

    Args:
        hidden: hidden effects.
        seed: of the excitation.
        noise: seed of the sensors' noise.
        held: as in `Case`.
    """
    force, noise = excitation(seed), seed + 7 if noise is None else noise
    return recorded(force, hidden, NOISE * size_of(force, held=held), noise, held=held)


def solve(case: Case) -> Outcome:
    """Simulate a case and explain it."""
    data = simulated(case)
    begin = time.perf_counter()
    bench, rows, verdict = explained(study(), data)
    seconds = time.perf_counter() - begin
    best = verdict.best.fitted if verdict.best else None
    second = verdict.second
    if len(case.hidden) == 2 and verdict.best and not second:
        second = _named_next(verdict.best, data)
    return Outcome(
        case, verdict.word, (*verdict.members, *verdict.rivals), second,
        bench.floor.ratio(bench.base.held_out), bench.floor.ratio(best.held_out) if best else None,
        verdict.evidence, _covered(bench, case, rows), seconds,
    )  # fmt: skip


def simulated(case: Case) -> Data:
    """The recordings of a case: fitted to, held out, healthy."""
    share = case.share / max(np.sqrt(len(case.hidden)), 1.0)
    hidden = tuple(
        Hidden(name, strength_for(name, excitation(case.seed), share, held=case.held))
        for name in case.hidden
    )
    uses = ((hidden, 0), (hidden, 1000), ((), 2000))
    made = [
        noisy(effects, case.seed + more, _noise_seed(case, more), held=case.held)
        for effects, more in uses
    ]
    return Data(made[0], made[1], made[2], HORIZON, ())


def _noise_seed(case: Case, use: int) -> int:
    """Seed of the noise of one recording.

    Cases of one excitation have noise of their own: with common noise all of their parameters would
    be wrong alike, and the intervals counted would be as few as the seeds.
    """
    return zlib.crc32(f"{case.hidden} {case.share} {case.seed} {case.held} {use}".encode())


def _named_next(best: Ranked, data: Data) -> tuple[str, ...]:
    """Labels named after the best has been added."""
    _, _, verdict = explained(study((accepted_from(best),)), data)
    return (*verdict.members, *verdict.rivals)


def explained(of: Study, data: Data) -> tuple[Bench, list[Ranked], Verdict]:
    """The workbench's steps without its files."""
    scale = NOISE * np.nanstd(data.train.outputs, axis=0)
    bench = bench_of(of, data, scale)
    return bench, *ranking(bench)


def _covered(bench: Bench, case: Case, rows: Sequence[Ranked]) -> tuple[int, int]:
    """Intervals that contain the truth, and their number, if the model is right."""
    true = {"m": MASS, "c": DAMPING, "k": STIFFNESS}
    fitted = None if case.hidden else bench.base
    if len(case.hidden) == 1 and case.hidden[0] in EXACT:
        name = case.hidden[0]
        right = [row for row in rows if row.label in RIGHT[name][:1] and row.fitted]
        fitted = right[0].fitted if right else None
        if fitted and EXACT[name]:
            strength = strength_for(name, excitation(case.seed), case.share, held=case.held)
            true[f"{fitted.placements[-1].prefix}{EXACT[name]}"] = strength
    if fitted is None:
        return 0, 0
    more = added_variances(bench.study, bench.data, bench.bare, fitted)
    found = values(fitted.train, more)
    inside = [
        low <= true[name] <= high
        for name in true
        if (interval := found[name].interval) is not None
        for low, high in [interval]
    ]
    return sum(inside), len(inside)


def cases(quick: bool) -> Iterator[Case]:
    """The cases, most important strengths first."""
    seeds = range(10, 11 if quick else 10 + SEEDS)
    for share in (0.05,) if quick else (0.05, 0.01, 0.02, 0.1, 0.005):
        for seed in seeds:
            yield from (Case((name,), share, seed) for name in (QUICK if quick else ANALOG))
    for seed in seeds:
        yield from (Case((name,), 0.05, seed) for name in UNKNOWN[: 1 if quick else None])
        yield from (Case(pair, 0.05, seed) for pair in PAIRS[: 1 if quick else None])
    for seed in range(2 if quick else HEALTHY):
        yield Case((), 0.0, 10 + seed // 2 + (seed % 2) * HEALTHY_JUDGED)


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    return rows_of([solve(case) for case in cases(quick)])


def rows_of(outcomes: Sequence[Outcome]) -> list[Row]:
    """Rows from outcomes."""
    single = [o for o in outcomes if len(o.case.hidden) == 1 and o.case.hidden[0] in RIGHT]
    strong = [o for o in single if o.case.share >= 0.01]
    seen = [o for o in strong if o.before >= STRONG]
    lagging = [o for o in strong if o.case.hidden[0].endswith("_lag")]
    healthy = [o for o in outcomes if not o.case.hidden]
    unknown = [o for o in outcomes if o.case.hidden and o.case.hidden[0] in UNKNOWN]
    pairs = [o for o in outcomes if len(o.case.hidden) == 2]
    after = [o.after for o in strong if o.right and o.after is not None]
    inside, of = (sum(o.covered[k] for o in outcomes) for k in (0, 1))
    return [
        share_row("hidden effects: right effect or class first, from 1 % and twice the floor",
                  [o.right for o in seen], 0.97, _mistaken(seen)),
        share_row("the same from 1 %, also what the fit leaves less of than twice the floor",
                  [o.right for o in strong], None, _mistaken(strong)),
        share_row("the same at 0.5 %", [o.right for o in single if o.case.share < 0.01], None,
                  _mistaken([o for o in single if o.case.share < 0.01])),
        share_row("class of at most 3", [len(o.first) <= 3 for o in seen], 0.9,
                  counted(o.case.hidden[0] for o in seen if len(o.first) > 3)),
        share_row("sensor lag named as such", [o.right for o in lagging], 0.95,
                  _mistaken(lagging)),
        share_row("healthy not called missing_effect",
                  [o.word != "missing_effect" for o in healthy], 0.99, _mistaken(healthy)),
        share_row("outside the library: unknown_effect",
                  [o.word == "unknown_effect" for o in unknown], 0.95, _mistaken(unknown)),
        share_row("two effects at once, both named in two steps", [o.both for o in pairs], 0.9,
                  counted(f"{'+'.join(o.case.hidden)} as {o.called}, {' '.join(o.second[:1])}"
                          for o in pairs if not o.both)),
        Row("held-out error over floor with the right effect, median and 95th of 100",
            f"{np.median(after):.3f}, {np.percentile(after, 95):.3f}" if after else "-", "≤ 1.10",
            "", "", bool(np.median(after) <= 1.1) if after else None),
        Row("95 % intervals that hold the truth", f"{inside}/{of} = {inside / max(of, 1):.1%}",
            "93 to 97 %", "", "", None if of < 60 else bool(0.93 <= inside / of <= 0.97)),
        _calibration_row([o for o in outcomes if o.case.judges]),
        Row("one explain with refits, median and longest",
            f"{np.median([o.seconds for o in outcomes]):.1f} s,"
            f" {max(o.seconds for o in outcomes):.0f} s", "10 s", "", "",
            bool(np.median([o.seconds for o in outcomes]) <= 10)),
    ]  # fmt: skip


def _mistaken(outcomes: Sequence[Outcome]) -> str:
    """Wrong names by hidden effect, the most frequent first."""
    return counted(
        f"{'+'.join(o.case.hidden) or 'healthy'} as {o.called}" for o in outcomes if o.wrong
    )


def _calibration_row(outcomes: Sequence[Outcome]) -> Row:
    """Predicted and observed wrong verdicts, on held-out seeds."""
    promised = sum(calibration.probability_wrong(o.word, o.evidence) for o in outcomes)
    spread = sum(
        d * (1 - d) for o in outcomes for d in [calibration.probability_wrong(o.word, o.evidence)]
    )
    came = sum(o.wrong for o in outcomes)
    within = abs(promised - came) <= 2 * np.sqrt(spread) if outcomes else None
    return Row("wrong verdicts on other seeds, promised and found",
               f"{promised:.1f} and {came} of {len(outcomes)}", "within 2 sd", "", "",
               None if within is None else bool(within))  # fmt: skip


def calibrated(outcomes: Sequence[Outcome]) -> str:
    """The text of the workbench's calibration file, from the calibration seeds."""
    cells: dict[tuple[str, int, int], list[bool]] = {}
    for outcome in outcomes:
        if not outcome.case.judges:
            cell = cell_of(outcome.word, outcome.evidence)
            cells.setdefault(cell, []).append(outcome.wrong)
    lines = [
        "# Written by `python -m benchmarks.explaining.hidden_effects --calibrate`: verdicts on"
    ]
    lines += ["# simulated plants by cell; the cells are those of calibration.py."]
    for (word, left, margin), wrong in sorted(cells.items()):
        lines += ["", "[[cells]]", f'word = "{word}"', f"left = {left}", f"margin = {margin}"]
        lines += [f"cases = {len(wrong)}", f"wrong = {sum(wrong)}"]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run cases into a file, one line each; print their table."""
    parser = asked(__doc__)
    parser.add_argument("--calibrate", action="store_true", help="write the calibration file")
    chosen = parser.parse_args()
    tried = (case for case in cases(quick=False) if wanted(case, chosen))
    found = collected(
        chosen.results,
        Outcome,
        () if chosen.calibrate else tried,
        solve,
        said=_line,
        minutes=chosen.minutes,
    )
    if chosen.calibrate:
        path = Path(calibration.__file__).with_name(calibration.FILE)
        path.write_text(calibrated(found), encoding="utf-8")
    print(as_text(rows_of(found)))
    print(confusion((o.case.hidden, o.called) for o in found))
    return 0


def _line(o: Outcome) -> str:
    after = f" → {o.after:.3f}" if o.after else ""
    mark = "WRONG " if o.wrong else ""
    return (
        f"{mark}{'+'.join(o.case.hidden) or 'healthy'} {o.case.share:g} {o.case.seed}: {o.word}"
        f" {', '.join(o.first)} | {', '.join(o.second)}; {o.before:.3f}{after},"
        f" left {o.evidence.left:.3f}, margin {o.evidence.margin:.1f}, {o.seconds:.1f} s"
    )


if __name__ == "__main__":
    sys.exit(main())
