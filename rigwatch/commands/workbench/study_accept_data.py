"""`rigwatch study accept-data`: continues with recordings that have changed."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result

HELP = "accept recordings that have changed since the last step"
EXAMPLE = "  rigwatch study accept-data emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.study import ledger, open_study

    line = ledger.append(open_study(arguments.study), "accept-data")
    told = f"{arguments.study}: continues with the recordings as they are now"
    print_result(arguments, line, told)
    return 0
