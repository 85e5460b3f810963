"""`rigwatch record`: records all messages of a rig in session files."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_json

HELP = "record samples, estimates, alarms and events of a rig"
EXAMPLE = """  rigwatch record configs/demo.toml
  rigwatch record configs/demo.toml --notes 'bearing at 300 kPa'"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")
    parser.add_argument("--notes", default="", help="remark kept in the session")


def run(arguments: argparse.Namespace) -> int:
    """Record until a signal ends it, then print the session's path."""
    from rigwatch.recorder import run as record
    from rigwatch.wire.host import set_at_signal

    folder = record(arguments.config, set_at_signal(), arguments.notes)
    if arguments.json:
        print_json({"session": folder})
    else:
        print(folder)
    return 0
