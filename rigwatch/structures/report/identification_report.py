"""The results of identification methods as one web page that needs no network."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite

import numpy as np

from rigwatch.page import Plot, limits, page
from rigwatch.structures.identification import (
    SETTLED,
    Identification,
    Problem,
    modelled,
    seconds_of,
)
from rigwatch.wire.arrays import FloatArray

Series = Mapping[str, FloatArray]

COLOURS = ("held", "before", "model", "rest", "good")
"""Colour classes of the five methods in the page's style."""
SMALLEST = 1e-8
"""Smallest relative change drawn."""
MOST = 1e6
FOLLOWS = 0.5
"""Residual share of the signals below which a trajectory follows them."""
MARKED = 60
"""Number of iterations up to which each has a marker."""


@dataclass(frozen=True, eq=False)
class Findings:
    """The contents of the report.

    Attributes:
        problem: the identification problem.
        record: name of the record.
        found: by method, in the order in which they are shown.
        failed: message of each method that failed.
    """

    problem: Problem
    record: str
    found: Mapping[str, Identification]
    failed: Mapping[str, str]

    @cached_property
    def modelled(self) -> dict[str, FloatArray]:
        """Outputs by method, each of shape (samples, outputs)."""
        return {method: modelled(self.problem, one) for method, one in self.found.items()}

    @property
    def converged(self) -> list[str]:
        """Methods that converged."""
        return [method for method, one in self.found.items() if one.converged]

    @property
    def legend(self) -> list[tuple[str, str]]:
        """Colour and name of each method."""
        return list(zip(COLOURS, self.found, strict=False))


def report_html(findings: Findings) -> str:
    """The page."""
    return page(
        "rigwatch.structures.report",
        "identification.html",
        f=findings,
        name=findings.problem.system.model.name,
        headline=_headline(findings),
        left={method: _left(findings, method) for method in findings.found},
        iterations=_iterations(findings),
        signals=_signals(findings),
    )


def _headline(f: Findings) -> str:
    """The method that explains most, if any explains something."""
    if not f.converged:
        return "no method converged"
    shares = {m: np.nan_to_num(_share(f, m), nan=np.inf) for m in f.converged}
    best = min(shares, key=lambda method: shares[method])
    if shares[best] > FOLLOWS:
        return "converged, but no trajectory follows the whole record"
    return f"{best} leaves {_left(f, best)} of the signals"


def _left(f: Findings, method: str) -> str:
    share = _share(f, method)
    return f"{100 * share:.3g} %" if isfinite(share) else "all"


def _share(f: Findings, method: str) -> float:
    """Unexplained share of the signals, each over its rms."""
    observed = f.problem.observed
    seen = np.isfinite(observed).any(axis=0)
    with np.errstate(all="ignore"):
        left = np.nanmean((f.modelled[method] - observed)[:, seen] ** 2, axis=0)
        return float(np.sqrt(np.mean(left / np.nanmean(observed[:, seen] ** 2, axis=0))))


def _iterations(f: Findings) -> str:
    """The convergence of each method."""
    changes = {method: _changes(f.problem, one) for method, one in f.found.items()}
    longest = max((len(c) for c in changes.values()), default=1)
    high = max((float(c.max()) for c in changes.values() if len(c)), default=1.0)
    words = "largest relative change"
    ends = (SMALLEST, max(10.0 * high, 1.0))
    plot = Plot(words, (0.5, longest + 0.5), ends, "iteration", words, height=280, y_log=True)
    plot.line(np.array([0.5, longest + 0.5]), np.full(2, SETTLED), "soft", dash="6 5")
    plot.text(longest + 0.45, SETTLED, "settled to four digits", anchor="end", up=-14)
    for colour, method in f.legend:
        drawn = changes[method]
        moved = np.flatnonzero(drawn)  # some methods count the guess as their first iteration
        plot.line(
            moved + np.float64(1.0), drawn[moved], colour, marks=longest <= MARKED, name=method
        )
    return plot.drawn()


def _changes(problem: Problem, one: Identification) -> FloatArray:
    """Largest relative change at each iteration, the first from the guess; shape (iterations,).

    0 if nothing changed.
    """
    path = np.vstack([problem.guess, one.iterations])
    size = np.maximum(np.abs(path[1:]), 1e-9 * np.abs(path[1:]).max(initial=1e-300))
    change = (np.abs(np.diff(path, axis=0)) / size).max(axis=1)
    seen = np.clip(np.nan_to_num(change, nan=MOST), SMALLEST, MOST)
    return np.where(change == 0, 0.0, seen)


def _signals(f: Findings) -> Iterator[tuple[str, str, str]]:
    """Name of each measured output, its plot, and the plot of its residual."""
    seconds, outputs = seconds_of(f.problem), f.problem.system.model.outputs
    for k, (name, output) in enumerate(outputs.items()):
        measured = f.problem.observed[:, k]
        if np.isfinite(measured).any():
            made = {method: values[:, k] for method, values in f.modelled.items()}
            yield (
                name,
                _signal(f, seconds, measured, made, f"{name} [{output.unit}]"),
                _residual(f, seconds, measured, made, f"residual [{output.unit}]"),
            )


def _signal(
    f: Findings, seconds: FloatArray, measured: FloatArray, made: Series, words: str
) -> str:
    span = (float(seconds[0]), float(seconds[-1]))
    plot = Plot(f"{words}, measured and modelled", span, limits(measured), "", words, height=190)
    plot.line(seconds, measured, "measured", width=4)
    for colour, method in f.legend:
        plot.line(seconds, made[method], colour, name=method)
    return plot.drawn()


def _residual(
    f: Findings, seconds: FloatArray, measured: FloatArray, made: Series, words: str
) -> str:
    left = {method: measured - values for method, values in made.items()}
    span = (float(seconds[0]), float(seconds[-1]))
    plot = Plot(
        "what is left", span, _usual(list(left.values()), measured), "time [s]", words, height=150
    )
    for colour, method in f.legend:
        plot.line(seconds, left[method], colour, width=1.2, name=method)
    return plot.drawn()


def _usual(residuals: Sequence[FloatArray], measured: FloatArray) -> tuple[float, float]:
    """Limits of the axis, unaffected by a method that diverges."""
    most = 1.5 * float(np.nanmax(np.abs(measured)))
    return limits(np.zeros(1), *(np.clip(r, -most, most) for r in residuals))
