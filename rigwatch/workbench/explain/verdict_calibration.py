"""How often similar verdicts were wrong on simulated plants with known truth.

A verdict falls into a cell by its word, the share of the error above the floor that the named
effect leaves, and the margin by which it beats effects outside its class. `calibration.toml` counts
the verdicts of each cell on simulated plants and how many were wrong. With k of n wrong,

    probability of being wrong = (k + s·r)/(n + s),   r = (K + 1)/(N + 2)

where K of N verdicts with the same word were wrong over all cells (P. S. Laplace's rule of
succession, 1774). The rate r weighs as much as s = 2 cases, so a cell with few cases relies on the
others. `benchmarks/explaining/hidden_effects` writes the file and evaluates it on held-out seeds.

Verdicts along the measured motion are counted apart, in `calibration_along.toml`, by word and by
whether the model is rough: there the share that is left holds the model's own error.
`benchmarks/family/along_calibration` counts them on simulated rigs and evaluates them on rigs of
other equations.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated

import numpy as np
from msgspec import Meta

from rigwatch.wire.typed_files import Section, parse

LEFT_EDGES = (0.02, 0.1)
"""Cell edges: share of the energy above the floor that the named effect leaves."""
MARGIN_EDGES = (3.0, 6.0)
"""Cell edges: standard deviations by which it beats the best of the others."""
PRIOR_CASES = 2.0
"""Number of cases that a word's rate over all cells weighs in each cell."""
FILE = "calibration.toml"
ALONG_FILE = "calibration_along.toml"
LATER_COUNTS = (78, 4)
"""Number of verdicts on later steps, after an effect was added, and how many were wrong: chains of
two and three hidden effects on five simulated machines (`benchmarks/explaining/chains`). Later
steps are wrong more often than first steps, which the cells count.
"""


@dataclass(frozen=True)
class Evidence:
    """What a verdict is based on.

    Attributes:
        left: share of the energy above the noise floor that the named effect leaves.
        margin: paired held-out difference to the best effect outside its class and rivals, in
            standard deviations; `CLEAR` if there is no other effect.
    """

    left: float = 1.0
    margin: float = 0.0


CLEAR = 99.0


class Cell(Section, frozen=True, kw_only=True):
    """Counts of similar verdicts."""

    word: Annotated[str, Meta(description="the verdict")]
    left: Annotated[int, Meta(ge=0, le=len(LEFT_EDGES), description="which cell of `left`")]
    margin: Annotated[int, Meta(ge=0, le=len(MARGIN_EDGES), description="which cell of `margin`")]
    cases: Annotated[int, Meta(ge=0, description="simulated cases with such a verdict")]
    wrong: Annotated[int, Meta(ge=0, description="those where it was wrong")]


class Calibration(Section, frozen=True, kw_only=True):
    """The file of free runs."""

    cells: list[Cell]


class AlongCell(Section, frozen=True, kw_only=True):
    """Counts of verdicts along the measured motion."""

    word: Annotated[str, Meta(description="the verdict")]
    rough: Annotated[bool, Meta(description="whether the model is rough")]
    cases: Annotated[int, Meta(ge=0, description="simulated cases with such a verdict")]
    wrong: Annotated[int, Meta(ge=0, description="those where it was wrong")]


class AlongCalibration(Section, frozen=True, kw_only=True):
    """The file of models along the measured motion."""

    cells: list[AlongCell]


def cell_of(word: str, evidence: Evidence) -> tuple[str, int, int]:
    """The cell of a verdict: word, index of `left`, index of `margin`."""
    left = int(np.searchsorted(LEFT_EDGES, max(evidence.left, 0.0)))
    return word, left, int(np.searchsorted(MARGIN_EDGES, evidence.margin))


def cases_seen(word: str, evidence: Evidence) -> tuple[int, int]:
    """Number of simulated cases in the verdict's cell, and how many of them were wrong."""
    return _counts().get(cell_of(word, evidence), (0, 0))


def later_probability_wrong() -> float:
    """Probability that the verdict on a later step is wrong."""
    cases, wrong = LATER_COUNTS
    return (wrong + 1) / (cases + 2)


def cases_seen_along(word: str, *, rough: bool) -> tuple[int, int]:
    """Number of verdicts with the same word along the measured motion, and how many were wrong."""
    return _along_counts().get((rough, word), (0, 0))


def probability_wrong_along(word: str, *, rough: bool) -> float | None:
    """Probability that a verdict along the measured motion is wrong; None without such a case."""
    cases, wrong = cases_seen_along(word, rough=rough)
    return (wrong + 1) / (cases + 2) if cases else None


def probability_wrong(word: str, evidence: Evidence) -> float:
    """Probability that the verdict is wrong; 0.5 if its cell has no simulated case."""
    cases, wrong = cases_seen(word, evidence)
    if not cases:
        return 0.5
    same = [count for cell, count in _counts().items() if cell[0] == word]
    rate = (sum(k for _, k in same) + 1) / (sum(n for n, _ in same) + 2)
    return (wrong + PRIOR_CASES * rate) / (cases + PRIOR_CASES)


@cache
def _counts() -> dict[tuple[str, int, int], tuple[int, int]]:
    cells = parse(_text(FILE), Calibration, FILE).cells
    return {(c.word, c.left, c.margin): (c.cases, c.wrong) for c in cells}


@cache
def _along_counts() -> dict[tuple[bool, str], tuple[int, int]]:
    cells = parse(_text(ALONG_FILE), AlongCalibration, ALONG_FILE).cells
    return {(c.rough, c.word): (c.cases, c.wrong) for c in cells}


def _text(name: str) -> str:
    return (resources.files("rigwatch.workbench.explain") / name).read_text("utf-8")
