"""`rigwatch study report`: the whole study as one web page."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result, say

HELP = "write the whole study as one HTML page that needs no network"
EXAMPLE = "  rigwatch study report emps --output emps.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument(
        "--output", type=Path, metavar="HTML", help="default: report.html in the study's folder"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the page is written."""
    from rigwatch.workbench.report import write_report
    from rigwatch.workbench.study import open_study

    study = open_study(arguments.study)
    path = arguments.output or study.folder / "report.html"
    found = write_report(study, path, progress=say)
    last = found.stages[-1].comparison
    error = f"{last.told(last.held_out_error):.4g} {last.told_in}"
    print_result(
        arguments,
        {"file": path, "verdict": found.explanation.verdict, "comparison": last},
        f"{path}: {len(found.stages)} steps, held-out error {error}",
    )
    return 0
