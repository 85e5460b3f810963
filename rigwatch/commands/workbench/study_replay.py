"""`rigwatch study replay`: fits every step of the ledger again and compares."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json, say

HELP = "fit every step of a study again and compare with its ledger"
EXAMPLE = "  rigwatch study replay emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 where every step gives the same; 1 where one gives other errors than the ledger."""
    from rigwatch.workbench.steps import replay
    from rigwatch.workbench.study import open_study

    checks = replay(open_study(arguments.study), progress=say)
    if arguments.json:
        print_json(checks)
    else:
        for check in checks:
            print(f"{'same' if check.same else 'DIFFERS'}: {check.text}")
    return 0 if all(check.same for check in checks) else 1
