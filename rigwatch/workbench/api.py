"""The workbench from Python and in notebooks: the commands as functions.

Each function takes the study's folder and reads it again, as the commands do, so a cell always
shows the current study. Results display as a table when they are a cell's last line.
"""

from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Generic, TypeVar

from rigwatch.workbench.compare import Comparison, Region, open_bench
from rigwatch.workbench.compare import compare as _compare
from rigwatch.workbench.compare import locate as _locate
from rigwatch.workbench.explain import Explanation
from rigwatch.workbench.explain import explain as _explain
from rigwatch.workbench.report import (
    change_lines,
    comparison_lines,
    explanation_lines,
    region_lines,
    write_report,
)
from rigwatch.workbench.steps import Change, change
from rigwatch.workbench.study import create, open_study

Found = TypeVar("Found")
MOST_REGIONS = 3


class Shown(Generic[Found]):
    """A result with a text representation for the terminal and for notebooks.

    Attributes:
        found: the result object.
    """

    def __init__(self, found: Found, lines: Callable[[Found], Sequence[str]]) -> None:
        self.found, self._lines = found, lines

    def __repr__(self) -> str:
        return "\n".join(self._lines(self.found))

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"


def new(folder: Path | str, template: Path | str, sessions: Path | str | None = None) -> Path:
    """Create a study from a template (`rigwatch study new`); return its folder."""
    return create(folder, template, sessions).folder


def compare(folder: Path | str, *, profile: bool = False) -> Shown[Comparison]:
    """Errors, noise floor and parameters (`rigwatch compare`)."""
    return Shown(_compare(open_study(folder), profiled=profile), comparison_lines)


def locate(folder: Path | str) -> Shown[list[Region]]:
    """Where the model fails (`rigwatch locate`)."""
    found = _locate(open_bench(open_study(folder)))
    return Shown(found, lambda regions: region_lines(regions, MOST_REGIONS))


def explain(folder: Path | str) -> Shown[Explanation]:
    """Which effects may be missing (`rigwatch explain`)."""
    return Shown(_explain(open_study(folder)), explanation_lines)


def add(
    folder: Path | str, effect: str, port: str | None = None, *, anyway: bool = False
) -> Shown[Change]:
    """Add an effect to the model if the held-out error supports it (`rigwatch add`)."""
    return Shown(change.add(open_study(folder), effect, port, anyway=anyway), change_lines)


def undo(folder: Path | str) -> Shown[Change]:
    """Remove the last effect (`rigwatch undo`)."""
    return Shown(change.undo(open_study(folder)), change_lines)


def report(folder: Path | str, path: Path | str) -> Path:
    """Write the study's report (`rigwatch study report`); return its path."""
    write_report(open_study(folder), Path(path))
    return Path(path)
