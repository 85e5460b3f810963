"""`rigwatch compare`: fit a model and show its errors on training and held-out recordings."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigwatch.commands.common import add_studies, print_result, run_studies, the_study

if TYPE_CHECKING:
    from rigwatch.workbench.compare import Comparison

HELP = "fit a model and show its errors on training and held-out recordings"
EXAMPLE = """\
  rigwatch compare emps
  rigwatch compare emps --profile
  rigwatch compare studies --on dask://host:8786 --results errors.parquet"""

_ERRORS = (("train", "in training"), ("held_out", "held out"))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_studies(parser)
    parser.add_argument(
        "--profile",
        action="store_true",
        help="compute intervals from the profile likelihood, which takes many fits",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success; 1 if some of several studies failed."""
    folder = the_study(arguments)
    if folder is None:
        return run_studies(arguments, "compare", compared, _line, profiled=arguments.profile)
    return _run_one(arguments, folder)


def compared(folder: Path, profiled: bool) -> "Comparison":
    """The errors of one study."""
    from rigwatch.workbench.compare import compare
    from rigwatch.workbench.study import open_study

    return compare(open_study(folder), profiled=profiled)


def _line(found: dict[str, Any]) -> str:
    from rigwatch.workbench.study import told

    unit = found["told_in"]
    errors = ((told(found[f"{name}_error"], unit), text) for name, text in _ERRORS)
    said = ", ".join(f"{text} {error:.4g}" for error, text in errors)
    return f"error {said} {unit}, noise floor {told(found['noise_floor'], unit):.4g}"


def _run_one(arguments: argparse.Namespace, folder: Path) -> int:
    from rigwatch.workbench.report import comparison_lines

    found = compared(folder, arguments.profile)
    print_result(arguments, found, comparison_lines(found))
    return 0
