"""`rigwatch demo`: runs a simulated rig from commissioning to an alarm that names friction."""

import argparse
import json
from contextlib import nullcontext
from math import inf
from pathlib import Path

from rigwatch.commands.common import POSITIVE, say

HELP = "run a simulated rig: friction appears, an alarm names it, a recording remains"
EXAMPLE = """  rigwatch demo
  rigwatch demo --headless --seconds 35
  rigwatch demo --commission-only"""
LONGEST, AFTER_NAMED = 150.0, 20.0
"""Longest headless run, and longest time in it after friction is named; within one cycle [s]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "--headless",
        action="store_true",
        help="no window; ends soon after friction is named, with exit code 0 only if it is",
    )
    parser.add_argument("--seconds", type=POSITIVE, metavar="N", help="maximum run time [s]")
    parser.add_argument(
        "--folder",
        type=Path,
        help="output folder; default: demo-session, or demo-session-2 and so on while it is in use",
    )
    parser.add_argument(
        "--commission-only", action="store_true", help="make the model of the simulated rig and end"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 if the demonstration succeeded."""
    from rigwatch.demo import own_folder

    with own_folder(arguments.folder) as folder:
        return _run(arguments, folder)


def _run(arguments: argparse.Namespace, folder: Path) -> int:
    from rigwatch.demo import (
        Pages,
        Show,
        ensure_model,
        forget_alarms,
        workbench_pages,
        write_rig_file,
    )
    from rigwatch.wire.typed_files import find_config

    config = find_config("demo.toml")
    say(f"all that the demo writes is in the folder {folder}, which may be deleted afterwards")
    ensure_model(config, folder, say)
    if arguments.commission_only:
        return 0
    forget_alarms(folder)
    rig = write_rig_file(config, folder, "web" if arguments.headless else "auto")
    seconds, after_named = inf, inf
    if arguments.headless:
        seconds, after_named = LONGEST, AFTER_NAMED
    if arguments.seconds is not None:
        seconds, after_named = arguments.seconds, inf
    beside = nullcontext(Pages()) if arguments.headless else workbench_pages(folder, rig, say)
    with beside as pages:
        attended = not arguments.headless
        show = Show(rig, folder, say, attended=attended, workbench=lambda: pages.address)
        outcome = show.play(seconds, after_named)
    if arguments.json:
        print(json.dumps(outcome.as_dict(), indent=1))
    # Whoever watches may end the demo before friction appears; a crash is a failure even then.
    failed = outcome.complaints if arguments.headless else outcome.exit_code
    return 1 if failed else 0
