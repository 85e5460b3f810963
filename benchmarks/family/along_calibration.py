"""How often verdicts along the measured motion are wrong: counted on some rigs, judged on others.

    python -m benchmarks.family.along_calibration FOLDER --results F --members calibration --seed 5
    python -m benchmarks.family.along_calibration FOLDER --results F --calibrate
    python -m benchmarks.family.along_calibration FOLDER --results F --members judged --seed 5

Counts come from the calibration members; predictions are tested on members with other equations. A
verdict is wrong if it names an effect that is not hidden, or reports a fault as nothing missing or
a fault of the library as unknown; a model that is not adequate names nothing and is not counted.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.explaining.hidden import collected
from benchmarks.family.rig_folder import RigFolder
from benchmarks.family.rig_folder_explain import (
    ACCEPTED,
    CLOSE,
    explanation,
    is_right,
    named,
    strength_of,
)
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.explain import verdict_calibration
from sim_plant.family import FLAVOURS, draw, write_rig
from tools.benchmark_table import Row, as_text

MODELS = {"servo-pneumatic": False, "fourth-order": True}
"""Base models, and whether they are rough."""
HELD = 0.9
"""Share of intervals that have to contain the truth."""


@dataclass(frozen=True)
class Case:
    """A recording of a drawn rig, the base model, and whether the study knows the mass."""

    member: str
    seed: int
    model: str
    recording: str
    weighed: bool = False


@dataclass(frozen=True)
class Outcome:
    """A verdict: its word, the hidden effect, whether it is right, and the strength found.

    `strength` contains the name, the truth, the value and its interval.
    """

    case: Case
    what: str
    word: str
    right: bool
    strength: tuple[str, float, float, float, float] | None = None

    @property
    def wrong(self) -> bool:
        """Whether the verdict is wrong."""
        if self.word == "unknown_effect":
            return self.what != "pressure"
        return not self.right

    @property
    def judges(self) -> bool:
        """Whether the rig's equations are held out from every choice."""
        return FLAVOURS[self.case.member].group == "judged"


def main() -> int:
    """Run cases into a file, one line each; print their table."""
    chosen = _parser().parse_args()
    tried = () if chosen.calibrate else _cases(chosen)
    found = collected(
        chosen.results,
        Outcome,
        tried,
        lambda case: _solve(chosen.folder, case),
        said=_line,
        minutes=chosen.minutes,
    )
    found = [outcome for outcome in found if outcome.word != "model_inadequate"]
    if chosen.calibrate:
        path = Path(verdict_calibration.__file__).with_name(verdict_calibration.ALONG_FILE)
        path.write_text(calibrated(found), encoding="utf-8")
    print(as_text([*_rows(found)]))
    return 0


def calibrated(outcomes: Sequence[Outcome]) -> str:
    """The text of the calibration file, from the calibration rigs."""
    cells: dict[tuple[bool, str], list[bool]] = {}
    for outcome in outcomes:
        if not outcome.judges:
            cells.setdefault((MODELS[outcome.case.model], outcome.word), []).append(outcome.wrong)
    lines = ["# Written by `python -m benchmarks.family.along_calibration --calibrate`: verdicts"]
    lines += ["# along the measured motion of simulated rigs, which differ in their equations."]
    for (rough, word), wrong in sorted(cells.items()):
        lines += ["", "[[cells]]", f'word = "{word}"', f"rough = {str(rough).lower()}"]
        lines += [f"cases = {len(wrong)}", f"wrong = {sum(wrong)}"]
    return "\n".join(lines) + "\n"


def _rows(outcomes: Sequence[Outcome]) -> Iterator[Row]:
    for model, rough in MODELS.items():
        own = [o for o in outcomes if o.judges and o.case.model == model]
        doubts = [verdict_calibration.probability_wrong_along(o.word, rough=rough) for o in own]
        known = [(d, o) for d, o in zip(doubts, own, strict=True) if d is not None]
        promised = sum(d for d, _ in known)
        spread = 2 * float(np.sqrt(sum(d * (1 - d) for d, _ in known)))
        came = sum(o.wrong for _, o in known)
        yield Row(f"wrong verdicts along the motion on other rigs, {model}: promised and found",
                  f"{promised:.1f} and {came} of {len(known)}", "at most promised and 2 sd", "", "",
                  came <= promised + spread if known else None)  # fmt: skip
        for weighed in (False, True):
            yield from _strengths(model, [o for o in own if o.case.weighed == weighed])


def _strengths(model: str, outcomes: Sequence[Outcome]) -> Iterator[Row]:
    found = [o.strength for o in outcomes if o.strength is not None]
    if not found:
        return
    given = "given" if outcomes[0].case.weighed else "not given"
    close = sum(abs(value / true - 1) <= CLOSE for _, true, value, _, _ in found)
    inside = sum(low <= true <= high for _, true, _, low, high in found)
    yield Row(f"strength within {CLOSE:.0%} of truth, and in its interval, {model}, mass {given}",
              f"{close} and {inside} of {len(found)}", "all and 90 %", "", "",
              close == len(found) and inside >= HELD * len(found))  # fmt: skip


def _cases(chosen: argparse.Namespace) -> Iterator[Case]:
    for seed in chosen.seed:
        for member, kind in FLAVOURS.items():
            if member in chosen.members or kind.group in chosen.members:
                for model in chosen.models:
                    truth = _rig(chosen.folder, member, seed).truth("explain")
                    for name, told in truth.items():
                        if told["what"] != "healthy":
                            yield Case(member, seed, model, name, chosen.weighed)


def _rig(folder: Path, member: str, seed: int) -> RigFolder:
    own = folder / f"{member}_{seed}"
    if not (own / "truth.json").exists():
        write_rig(own, draw(member, seed))
    return RigFolder(own, own / "work")


def _solve(folder: Path, case: Case) -> Outcome:
    rig = _rig(folder, case.member, case.seed)
    told = rig.truth("explain")[case.recording]
    said, failed = explanation(rig, case.recording, case.model, weighed=case.weighed)
    if not said:
        raise RigwatchError(failed)
    top, names = named(said)
    right = is_right(told["what"], said["verdict"], names)
    strength = strength_of(told, top) if right and told["what"] in ACCEPTED else None
    return Outcome(case, told["what"], said["verdict"], right, strength)


def _line(outcome: Outcome) -> str:
    mark = "WRONG" if outcome.wrong else "     "
    return f"{mark} {outcome.case} {outcome.what} {outcome.word}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.family.along_calibration", description=__doc__
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("folder", type=Path, help="rigs are written to it")
    parser.add_argument("--results", type=Path, required=True, help="file of JSON lines")
    parser.add_argument("--members", nargs="+", default=["calibration"])
    parser.add_argument("--models", nargs="+", default=list(MODELS), choices=MODELS)
    parser.add_argument("--seed", type=int, nargs="+", default=[5])
    parser.add_argument("--weighed", action="store_true", help="tell studies the mass, within 1 %%")
    parser.add_argument("--minutes", type=float, default=1e9, help="start no case after these")
    parser.add_argument("--calibrate", action="store_true", help="write the calibration file")
    return parser


if __name__ == "__main__":
    sys.exit(main())
