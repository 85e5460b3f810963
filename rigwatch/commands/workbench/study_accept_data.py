"""`rigwatch study accept-data`: continues with recordings that have changed."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json

HELP = "accept recordings that have changed since the last step"
EXAMPLE = "  rigwatch study accept-data emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.study import ledger, open_study

    line = ledger.append(open_study(arguments.study), "accept-data")
    if arguments.json:
        print_json(line)
    else:
        print(f"{arguments.study}: continues with the recordings as they are now")
    return 0
