"""How often similar verdicts were wrong on simulated plants with known truth.

A verdict falls into a cell by its word, the share of the error above the floor that the named
effect leaves, and the margin by which it beats effects outside its class. `calibration.toml` counts
the verdicts of each cell on simulated plants and how many were wrong. With k of n wrong,

    probability of being wrong = (k + 1)/(n + 2)                 rule of succession, P. S. Laplace
    upper bound p, 95 %:  P(at most k of n wrong | p) = 0.05     C. J. Clopper and E. S. Pearson

Other cells say nothing of a cell with few cases, and below `FEWEST` no probability is stated.
`benchmarks/explaining/hidden_effects` writes the file and evaluates it on held-out seeds.

First verdicts on logs that have lost rows, uneven times or clocks that differ are counted apart,
in `calibration_logged.toml`, by word: `benchmarks/explaining/user_logs` counts them on six
simulated machines, and compares each with what the five others promise.

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
from scipy.stats import beta

from rigwatch.wire.typed_files import Section, parse

LEFT_EDGES = (0.02, 0.1)
"""Cell edges: share of the energy above the floor that the named effect leaves."""
MARGIN_EDGES = (3.0, 6.0)
"""Cell edges: standard deviations by which it beats the best of the others."""
FEWEST = 30
"""Simulated cases from which a probability is stated."""
CONFIDENCE = 0.95
FILE = "calibration.toml"
ALONG_FILE = "calibration_along.toml"
LOGGED_FILE = "calibration_logged.toml"
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


class LoggedCell(Section, frozen=True, kw_only=True):
    """Counts of first verdicts on logs of real loggers."""

    word: Annotated[str, Meta(description="the verdict")]
    cases: Annotated[int, Meta(ge=0, description="simulated cases with such a verdict")]
    wrong: Annotated[int, Meta(ge=0, description="those where it was wrong")]


class LoggedCalibration(Section, frozen=True, kw_only=True):
    """The file of such logs."""

    cells: list[LoggedCell]


def cell_of(word: str, evidence: Evidence) -> tuple[str, int, int]:
    """The cell of a verdict: word, index of `left`, index of `margin`."""
    left = int(np.searchsorted(LEFT_EDGES, max(evidence.left, 0.0)))
    return word, left, int(np.searchsorted(MARGIN_EDGES, evidence.margin))


def cases_seen(word: str, evidence: Evidence) -> tuple[int, int]:
    """Number of simulated cases in the verdict's cell, and how many of them were wrong."""
    return _counts().get(cell_of(word, evidence), (0, 0))


def later_probability_wrong() -> float:
    """Probability that the verdict on a later step is wrong."""
    return _rate(*LATER_COUNTS)


def cases_seen_along(word: str, *, rough: bool) -> tuple[int, int]:
    """Number of verdicts with the same word along the measured motion, and how many were wrong."""
    return _along_counts().get((rough, word), (0, 0))


def cases_seen_logged(word: str) -> tuple[int, int]:
    """Number of the same first verdicts on logs of real loggers, and how many were wrong."""
    return _logged_counts().get(word, (0, 0))


def probability_wrong_along(word: str, *, rough: bool) -> float | None:
    """Probability that a verdict along the measured motion is wrong; None without such a case."""
    cases, wrong = cases_seen_along(word, rough=rough)
    return _rate(cases, wrong) if cases else None


def probability_wrong(word: str, evidence: Evidence) -> float:
    """Probability that the verdict is wrong; 0.5 if its cell has no simulated case."""
    return _rate(*cases_seen(word, evidence))


def probability_wrong_logged(word: str) -> float | None:
    """Probability that such a verdict is wrong; None without such a case."""
    cases, wrong = cases_seen_logged(word)
    return _rate(cases, wrong) if cases else None


def most_probably_wrong(cases: int, wrong: int) -> float | None:
    """Upper bound of the probability of being wrong, 95 %; None if there are too few cases."""
    if cases < FEWEST:
        return None
    return float(beta.ppf(CONFIDENCE, wrong + 1, cases - wrong)) if wrong < cases else 1.0


def _rate(cases: int, wrong: int) -> float:
    return (wrong + 1) / (cases + 2)


@cache
def _counts() -> dict[tuple[str, int, int], tuple[int, int]]:
    cells = parse(_text(FILE), Calibration, FILE).cells
    return {(c.word, c.left, c.margin): (c.cases, c.wrong) for c in cells}


@cache
def _along_counts() -> dict[tuple[bool, str], tuple[int, int]]:
    cells = parse(_text(ALONG_FILE), AlongCalibration, ALONG_FILE).cells
    return {(c.rough, c.word): (c.cases, c.wrong) for c in cells}


@cache
def _logged_counts() -> dict[str, tuple[int, int]]:
    cells = parse(_text(LOGGED_FILE), LoggedCalibration, LOGGED_FILE).cells
    return {c.word: (c.cases, c.wrong) for c in cells}


def _text(name: str) -> str:
    return (resources.files("rigwatch.workbench.explain") / name).read_text("utf-8")
