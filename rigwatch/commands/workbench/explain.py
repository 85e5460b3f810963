"""`rigwatch explain`: ranks the effects that the model may lack and gives a verdict."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json, say

HELP = "rank the effects that the model may lack and give a verdict"
EXAMPLE = "  rigwatch explain emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.explain import as_data, explain
    from rigwatch.workbench.report import explanation_lines
    from rigwatch.workbench.study import open_study

    found = explain(open_study(arguments.study), progress=say)
    if arguments.json:
        print_json(as_data(found))
        return 0
    print("\n".join(explanation_lines(found)))
    return 0
