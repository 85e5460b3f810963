"""`rigwatch study replay`: refits every step of the ledger and compares."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result, say

HELP = "refit every step of a study and compare with its ledger"
EXAMPLE = "  rigwatch study replay emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the action."""
    parser.add_argument("study", type=Path, help="the study's folder")


def run(arguments: argparse.Namespace) -> int:
    """0 if every step reproduces the ledger; 1 if an error differs."""
    from rigwatch.workbench.steps import replay
    from rigwatch.workbench.study import open_study

    checks = replay(open_study(arguments.study), progress=say)
    told = (f"{'same' if check.same else 'DIFFERS'}: {check.text}" for check in checks)
    print_result(arguments, checks, told)
    return 0 if all(check.same for check in checks) else 1
