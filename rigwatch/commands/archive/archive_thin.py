"""`rigwatch archive thin`: thins the oldest session of a recorder that has expired."""

import argparse
from datetime import UTC, datetime
from pathlib import Path

from rigwatch.commands.common import number, print_result, say

HELP = "keep of a rig's oldest session beyond an age its figures per second alone"
EXAMPLE = """\
  rigwatch archive thin sessions --rig bench1 --days 30
  rigwatch archive thin sessions --rig bench1 --days 30 --alarm-days 365 --idle"""
EXIT_FAILED = 1
LATEST = 2.5e11
"""The latest time that a date can be of [s]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("folder", metavar="FOLDER", help="folder of the recorder's sessions")
    parser.add_argument("--rig", required=True, help="id of the rig")
    parser.add_argument(
        "--days", type=number(0), default=0.0, metavar="N", help="age of a session [days]"
    )
    parser.add_argument(
        "--alarm-days", type=number(0), default=0.0, metavar="N",
        help="age of a session with alarms [days]; by default these stay",
    )  # fmt: skip
    parser.add_argument(
        "--now", type=number(0, LATEST), metavar="S",
        help="time to which ages are counted, as Unix time [s]; by default the clock's",
    )  # fmt: skip
    parser.add_argument(
        "--idle", action="store_true", help="take only processor time that nobody else wants"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 on success, 1 if the session cannot be thinned."""
    from rigwatch.archive import thin_oldest
    from rigwatch.wire.host import be_idle

    if arguments.idle:
        be_idle()
    now = None if arguments.now is None else datetime.fromtimestamp(arguments.now, UTC)
    folder, days, alarm_days = Path(arguments.folder), arguments.days, arguments.alarm_days
    done = thin_oldest(folder, arguments.rig, days, alarm_days, now=now)
    text = f"{done.session}: thinned, {done.size / 1e6:.1f} MB removed"
    print_result(arguments, done, [text if done.session else "no session has expired"])
    for failure in done.failures:
        say(f"failed: {failure}")
    return EXIT_FAILED if done.failures and not done.session else 0
