"""`rigwatch compare`: fit a model and show its errors on training and held-out recordings."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json

HELP = "fit a model and show its errors on training and held-out recordings"
EXAMPLE = """\
  rigwatch compare emps
  rigwatch compare emps --profile"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument(
        "--profile",
        action="store_true",
        help="compute intervals from the profile likelihood, which takes many fits",
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.compare import compare
    from rigwatch.workbench.report import comparison_lines
    from rigwatch.workbench.study import open_study

    found = compare(open_study(arguments.study), profiled=arguments.profile)
    if arguments.json:
        print_json(found)
        return 0
    print("\n".join(comparison_lines(found)))
    return 0
