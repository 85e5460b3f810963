"""`rigwatch undo`: removes the last effect of a study."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result, say

HELP = "remove the last effect from the model of a study"
EXAMPLE = "  rigwatch undo emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 if an effect is removed."""
    from rigwatch.workbench.report import change_lines
    from rigwatch.workbench.steps import undo
    from rigwatch.workbench.study import open_study

    change = undo(open_study(arguments.study), say)
    print_result(arguments, change, change_lines(change))
    return 0
