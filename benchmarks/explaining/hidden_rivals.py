"""Hidden effects with pysindy, SysIdentPy and the workbench, in one run.

The recordings are those of `benchmarks/explaining/hidden_effects`. A tool is right if it names the
hidden effect or, for the workbench, if the hidden effect is in the class named first. Both rivals
fit a list of terms; effects that no term of theirs can express (play, delays, anything with memory,
sensors) cannot be found by them, so their share among the effects that they can express is also
given.

    python -m benchmarks hidden_rivals --quick
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.explaining.hidden import counted, share_row
from benchmarks.explaining.hidden_effects import RIGHT, Case, explained, simulated
from benchmarks.explaining.rivals import NOTHING, TERMS, pysindy_names, sysidentpy_names
from rigwatch.workbench.data.signals import Data
from sim_plant.oscillator import UNKNOWN
from tests.workbench.simulated import study
from tools.benchmark_table import Row

POLYNOMIAL = ("constant_force", "quadratic_stiffness", "cubic_stiffness")
"""Effects that a polynomial NARX model can name."""


def workbench_names(data: Data) -> str:
    """Labels of the effect named first and its class, or the verdict."""
    _, _, verdict = explained(study(), data)
    named = verdict.word in ("missing_effect", "undetermined")
    return " ".join((*verdict.members, *verdict.rivals)) if named else verdict.word


TOOLS: dict[str, tuple[Callable[[Data], str], Sequence[str]]] = {
    "rigwatch": (workbench_names, tuple(RIGHT)),
    "pysindy": (
        lambda data: pysindy_names(data.train, data.held_out),
        tuple(name for name in TERMS if name in RIGHT),
    ),
    "SysIdentPy": (lambda data: sysidentpy_names(data.train, data.held_out), POLYNOMIAL),
}
"""Each tool's function, and the hidden effects that it can express."""


@dataclass(frozen=True)
class Answer:
    """One tool's result for one case."""

    tool: str
    case: Case
    said: str
    seconds: float

    @property
    def hidden(self) -> str:
        """The hidden effect."""
        return self.case.hidden[0] if self.case.hidden else "healthy"

    @property
    def right(self) -> bool:
        """Whether it is right."""
        if self.hidden == "healthy":
            return self.said == NOTHING
        if self.hidden in UNKNOWN:
            return self.said.startswith("unknown")
        return bool({self.hidden, *RIGHT[self.hidden]} & set(self.said.split()))


def cases(quick: bool) -> list[Case]:
    """The cases."""
    seeds = range(30, 31 if quick else 33)
    names = ("coulomb", "cubic_stiffness", "acceleration_lag") if quick else tuple(RIGHT)
    shares = (0.05,) if quick else (0.05, 0.01)
    found = [Case((name,), share, seed) for share in shares for name in names for seed in seeds]
    found += [Case((name,), 0.05, s) for name in UNKNOWN[: 1 if quick else None] for s in seeds]
    return found + [Case((), 0.0, 30 + k) for k in range(1 if quick else 12)]


def answers(case: Case) -> list[Answer]:
    """Each tool's result for one case."""
    data, found = simulated(case), []
    for tool, (names, _) in TOOLS.items():
        begin = time.perf_counter()
        said = names(data)
        found.append(Answer(tool, case, said, time.perf_counter() - begin))
    return found


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    found = [answer for case in cases(quick) for answer in answers(case)]
    return [row for tool in TOOLS for row in _rows(tool, [a for a in found if a.tool == tool])]


def _rows(tool: str, found: Sequence[Answer]) -> list[Row]:
    listed = [a for a in found if a.hidden in RIGHT]
    able = [a for a in listed if a.hidden in TOOLS[tool][1]]
    healthy = [a for a in found if a.hidden == "healthy"]
    unknown = [a for a in found if a.hidden in UNKNOWN]
    missed = counted(f"{a.hidden} as {a.said.partition(' ')[0]}" for a in able if not a.right)
    return [
        share_row(f"{tool}: hidden effect named", [a.right for a in listed], None, ""),
        share_row(f"{tool}: of those it can express", [a.right for a in able], None, missed),
        share_row(f"{tool}: nothing named where nothing is hidden",
                  [a.right for a in healthy], None, counted(a.said for a in healthy)),
        share_row(f"{tool}: unknown effects said to be unknown",
                  [a.right for a in unknown], None, counted(a.said for a in unknown)),
        Row(f"{tool}: median time of a case", f"{np.median([a.seconds for a in found]):.1f} s",
            "", "", "", None),
    ]  # fmt: skip
