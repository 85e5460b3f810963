"""Outcomes of chains, step by step, and their rows: good chains, wrong verdicts, ends.

The probability of a wrong verdict is calibrated on all machines except the one judged.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.explaining.hidden import share_row
from rigwatch.workbench.explain.verdict_calibration import Evidence, cell_of, probability_wrong
from tools.benchmark_table import Row

CONFIDENT = 0.05
"""Largest probability of being wrong at which a verdict counts as confident."""
PRIOR_CASES = 2.0
"""Number of cases that a word's rate over all cells weighs in each cell."""


@dataclass(frozen=True)
class Case:
    """One machine with a chain hidden in it.

    Attributes:
        machine: its name.
        hidden: names of the hidden effects.
        noise: of the sensors, relative to the rms of their signals.
        seed: of excitation and noise.
    """

    machine: str
    hidden: tuple[str, ...]
    noise: float
    seed: int


@dataclass(frozen=True)
class Step:
    """One step: a verdict and its classification.

    Attributes:
        judged: right, undecided, unknown, astray or wrong; "ended" or "more" once all are found.
        word: the verdict.
        named: labels that are named, the best first.
        added: the effect that the user added.
        evidence: the evidence of the verdict.
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
        """Whether each step was right or undecided until all effects were found."""
        on_the_way = [step for step in self.steps if step.judged not in ("ended", "more")]
        return self.complete and all(s.judged in ("right", "undecided") for s in on_the_way)

    @property
    def complete(self) -> bool:
        """Whether all hidden effects were found."""
        return self.steps[-1].judged in ("ended", "more")


def chain_rows(outcomes: Sequence[Outcome]) -> list[Row]:
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
        *_shipped(outcomes),
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
    """Wrong verdicts: predicted by the other machines, and observed."""
    rows = []
    for machine in dict.fromkeys(o.case.machine for o in outcomes):
        told = _named_steps([o for o in outcomes if o.case.machine != machine])
        own = _named_steps([o for o in outcomes if o.case.machine == machine])
        doubts = [_doubt(step, told) for step in own]
        rows.append(_promised(f"on {machine}, as the others promise", own, doubts))
    return rows


def _shipped(outcomes: Sequence[Outcome]) -> list[Row]:
    """Wrong verdicts: predicted by the calibration of first steps, and observed."""
    steps = {
        "first steps": [o.steps[0] for o in outcomes],
        "later steps": [step for o in outcomes for step in o.steps[1:]],
    }
    return [
        _promised(f"at {which}, as the shipped calibration promises", own,
                  [probability_wrong(step.word, step.evidence) for step in own])
        for which, own in steps.items()
    ]  # fmt: skip


def _promised(what: str, steps: Sequence[Step], doubts: Sequence[float]) -> Row:
    """Observed and predicted numbers of wrong verdicts."""
    found, most = sum(map(_is_wrong, steps)), most_by_chance(doubts)
    sure = [s for s, doubted in zip(steps, doubts, strict=True) if doubted <= CONFIDENT]
    return Row(
        f"chains: wrong verdicts {what}",
        f"{found} of {len(steps)}, {sum(doubts):.1f} promised", f"≤ {most}", "",
        f"the bar is what chance makes of the promise in 95 %; of {len(sure)} with at most"
        f" {CONFIDENT:.0%} promised {sum(map(_is_wrong, sure))} wrong", found <= most,
    )  # fmt: skip


def most_by_chance(doubts: Sequence[float], level: float = 0.95) -> int:
    """Number of wrong verdicts not exceeded with this probability; each has its own probability."""
    of_count = np.ones(1)
    for doubted in doubts:
        of_count = np.convolve(of_count, [1 - doubted, doubted])
    return int(np.searchsorted(np.cumsum(of_count), level))


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
    return (sum(map(_is_wrong, alike)) + PRIOR_CASES * rate) / (len(alike) + PRIOR_CASES)
