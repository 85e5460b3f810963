"""`rigwatch demo`: a simulated rig from commissioning to an alarm that names friction."""

import argparse
import json
import sys
from pathlib import Path

HELP = "watch a simulated rig: friction appears, an alarm names it, a recording is left"
EXAMPLE = """  rigwatch demo
  rigwatch demo --headless --seconds 35
  rigwatch demo --commission-only"""
LONGEST, AFTER_NAMED = 150.0, 8.0
"""A headless run ends so long after friction was named, and at the latest after one cycle [s]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "--headless",
        action="store_true",
        help="no window; ends once friction was named, with 0 only if it was",
    )
    parser.add_argument("--seconds", type=float, metavar="N", help="end after this long [s]")
    parser.add_argument(
        "--folder", type=Path, default=Path("demo-session"), help="where everything is written"
    )
    parser.add_argument(
        "--commission-only", action="store_true", help="make the model of the simulated rig and end"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 when the demonstration did what it is for."""
    from rigwatch.demo import Show, ensure_model, forget_alarms, write_rig_file
    from rigwatch.wire.typed_files import find_config

    folder: Path = arguments.folder
    folder.mkdir(parents=True, exist_ok=True)
    config = find_config("demo.toml")
    ensure_model(config, folder, _remark)
    if arguments.commission_only:
        return 0
    forget_alarms(folder)
    rig = write_rig_file(config, folder, "web" if arguments.headless else "auto")
    seconds, after_named = float("inf"), float("inf")
    if arguments.headless:
        seconds, after_named = LONGEST, AFTER_NAMED
    if arguments.seconds is not None:
        seconds, after_named = arguments.seconds, float("inf")
    outcome = Show(rig, folder, _remark).play(seconds, after_named)
    if arguments.json:
        print(json.dumps(outcome.as_dict(), indent=1))
    return 1 if arguments.headless and outcome.complaints else 0


def _remark(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
