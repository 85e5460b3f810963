"""How often a verdict like this one was wrong where the truth was known.

A verdict is put into a cell by its word, by how much of the error above the floor the named effect
leaves, and by how clearly it beats what it is not to be confused with. `calibration.toml` counts
the verdicts of each cell on simulated plants and those of them that were wrong; with k of n wrong

    probability of being wrong = (k + s·r)/(n + s),   r = (K + 1)/(N + 2)

where K of N verdicts with the same word were wrong over all cells (P. S. Laplace's rule of
succession, 1774) and count as much as s = 2 cases, so that a cell with few cases leans on the
others. `benchmarks/explaining/hidden_effects` writes the file, and judges it on seeds that it was
not made from.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated

import numpy as np
from msgspec import Meta

from rigwatch.wire.typed_files import Section, parse

LEFT = (0.02, 0.1)
"""Edges of cells: share of the energy above the floor that the named effect leaves."""
MARGIN = (3.0, 6.0)
"""Edges of cells: standard deviations by which it beats the best of the others."""
LEANING = 2.0
"""Cases that a word's rate over all cells counts as in each."""
FILE = "calibration.toml"


@dataclass(frozen=True)
class Evidence:
    """What a verdict rests on.

    Attributes:
        left: share of the energy above the noise floor that the named effect leaves.
        margin: standard deviations of the paired held-out difference to the best effect that it is
            not confused with; `CLEAR` where none came near.
    """

    left: float = 1.0
    margin: float = 0.0


CLEAR = 99.0


class Cell(Section, frozen=True, kw_only=True):
    """Verdicts that looked alike."""

    word: Annotated[str, Meta(description="the verdict")]
    left: Annotated[int, Meta(ge=0, le=len(LEFT), description="which cell of `left`")]
    margin: Annotated[int, Meta(ge=0, le=len(MARGIN), description="which cell of `margin`")]
    cases: Annotated[int, Meta(ge=0, description="simulated cases with such a verdict")]
    wrong: Annotated[int, Meta(ge=0, description="those where it was wrong")]


class Calibration(Section, frozen=True, kw_only=True):
    """The file."""

    cells: list[Cell]


def cell_of(word: str, evidence: Evidence) -> tuple[str, int, int]:
    """Which cell a verdict belongs to."""
    left = int(np.searchsorted(LEFT, max(evidence.left, 0.0)))
    return word, left, int(np.searchsorted(MARGIN, evidence.margin))


def seen(word: str, evidence: Evidence) -> tuple[int, int]:
    """Simulated cases with a verdict like this one, and how many of them were wrong."""
    return _counts().get(cell_of(word, evidence), (0, 0))


def doubt(word: str, evidence: Evidence) -> float:
    """Probability that the verdict is wrong; one half where no such case was simulated."""
    cases, wrong = seen(word, evidence)
    if not cases:
        return 0.5
    same = [count for cell, count in _counts().items() if cell[0] == word]
    rate = (sum(k for _, k in same) + 1) / (sum(n for n, _ in same) + 2)
    return (wrong + LEANING * rate) / (cases + LEANING)


@cache
def _counts() -> dict[tuple[str, int, int], tuple[int, int]]:
    text = (resources.files("rigwatch.workbench.explain") / FILE).read_text("utf-8")
    cells = parse(text, Calibration, FILE).cells
    return {(c.word, c.left, c.margin): (c.cases, c.wrong) for c in cells}
