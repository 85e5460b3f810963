"""`rigwatch locate`: shows where a model fails."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result, whole

HELP = "show where a model fails: by time, motion, direction, amplitude, frequency and channel"
EXAMPLE = "  rigwatch locate emps"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("study", type=Path, help="the study's folder")
    parser.add_argument("--view", help="only one view, such as motion")
    parser.add_argument("--most", type=whole(1), default=3, help="number of regions shown per view")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.workbench.compare import locate, open_bench
    from rigwatch.workbench.report import region_data, region_lines
    from rigwatch.workbench.study import open_study

    found = locate(open_bench(open_study(arguments.study)))
    if arguments.view:
        found = [region for region in found if region.view == arguments.view]
    print_result(arguments, region_data(found), region_lines(found, arguments.most))
    return 0
