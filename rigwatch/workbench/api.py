"""The workbench from Python and on a notebook's cell: the commands as functions.

Each takes the study's folder and reads it anew, as the commands do, so that a cell always shows the
study as it is. What they return shows itself as a table where it is a cell's last line.
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
    """A result that shows itself: as text, and as a block of text on a notebook's cell.

    Attributes:
        found: the result, with its numbers.
    """

    def __init__(self, found: Found, lines: Callable[[Found], Sequence[str]]) -> None:
        self.found, self._lines = found, lines

    def __repr__(self) -> str:
        return "\n".join(self._lines(self.found))

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"


def new(folder: Path | str, template: Path | str, sessions: Path | str | None = None) -> Path:
    """Make a study after a template (`rigwatch study new`); its folder."""
    return create(folder, template, sessions).folder


def compare(folder: Path | str, *, profile: bool = False) -> Shown[Comparison]:
    """Errors, noise floor and parameters (`rigwatch compare`)."""
    return Shown(_compare(open_study(folder), profiled=profile), comparison_lines)


def locate(folder: Path | str) -> Shown[list[Region]]:
    """Where the model fails (`rigwatch locate`)."""
    found = _locate(open_bench(open_study(folder)))
    return Shown(found, lambda regions: region_lines(regions, MOST_REGIONS))


def explain(folder: Path | str) -> Shown[Explanation]:
    """What may be missing (`rigwatch explain`)."""
    return Shown(_explain(open_study(folder)), explanation_lines)


def add(
    folder: Path | str, effect: str, port: str | None = None, *, anyway: bool = False
) -> Shown[Change]:
    """Put an effect into the model, if the recordings held out speak for it (`rigwatch add`)."""
    return Shown(change.add(open_study(folder), effect, port, anyway=anyway), change_lines)


def undo(folder: Path | str) -> Shown[Change]:
    """Take the last effect away (`rigwatch undo`)."""
    return Shown(change.undo(open_study(folder)), change_lines)


def report(folder: Path | str, path: Path | str) -> Path:
    """Write the study's page (`rigwatch study report`); its path."""
    write_report(open_study(folder), Path(path))
    return Path(path)
