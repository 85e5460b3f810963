"""`rigwatch record`: records all messages of a rig in session files."""

import argparse
from pathlib import Path

from rigwatch.commands.common import print_result

HELP = "record samples, estimates, alarms and events of one or several rigs"
EXAMPLE = """  rigwatch record configs/demo.toml
  rigwatch record configs/demo.toml --notes 'bearing at 300 kPa'
  rigwatch record rigs/*.toml           # several rigs in one process"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    help_ = "configuration of a rig; several rigs share the process"
    parser.add_argument("config", type=Path, nargs="+", metavar="CONFIG", help=help_)
    parser.add_argument("--notes", default="", help="remark kept in the session of each rig")


def run(arguments: argparse.Namespace) -> int:
    """Record until a signal ends it, then print each session's path, a line a rig."""
    from rigwatch.recorder import run as record
    from rigwatch.recorder import run_several
    from rigwatch.wire.host import set_at_signal

    paths, stop = arguments.config, set_at_signal()
    if len(paths) == 1:
        folder = record(paths[0], stop, arguments.notes)
        result: dict[str, object] = {"session": folder}
        folders = [folder] if folder is not None else []
    else:
        folders = run_several(paths, stop, arguments.notes)
        result = {"sessions": folders}
    if folders or arguments.json:
        print_result(arguments, result, map(str, folders))
    return 0
