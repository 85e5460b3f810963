"""`rigwatch ack`: acknowledges alarms, resets those whose cause is gone, or shelves one."""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common import add_user

if TYPE_CHECKING:
    from rigwatch.wire.messages import AlarmCommand

HELP = "acknowledge, reset or shelve alarms of a rig"
EXAMPLE = """  rigwatch ack configs/demo.toml --user ann
  rigwatch ack configs/demo.toml dry_friction --user ann --reset
  rigwatch ack configs/demo.toml loss --user ann --shelve --text "cable on order\""""
TIMEOUT = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")
    parser.add_argument("name", nargs="?", metavar="NAME", help="name of the alarm; default: all")
    add_user(parser)
    action = parser.add_mutually_exclusive_group()
    action.add_argument(
        "--reset", action="store_true", help="reset latched alarms whose condition has gone"
    )
    action.add_argument(
        "--shelve",
        action="store_true",
        help="do not announce the alarm NAME for eight hours; not for critical ones",
    )
    action.add_argument(
        "--unshelve", action="store_true", help="announce the alarm NAME again from now on"
    )
    parser.add_argument("--text", default="", help="remark kept in the journal")


def run(arguments: argparse.Namespace) -> int:
    """Send the command and print the changes; 1 if there are none."""
    from rigwatch.commands.alarms.alarms import as_line
    from rigwatch.wire.access import operator_name
    from rigwatch.wire.bus import command_alarms, connect, unique_process
    from rigwatch.wire.messages import json_fields
    from rigwatch.wire.rig_config import load_rig

    config = load_rig(arguments.config)
    command = command_of(arguments, operator_name(config.bus, arguments.user))
    bus = connect(config, unique_process("ack"), TIMEOUT)
    try:
        answer = command_alarms(bus, command)
    finally:
        bus.close()
    if arguments.json:
        alarms = [json_fields(alarm) for alarm in answer.changed]
        print(json.dumps({"changed": alarms, "shelf": answer.shelf, "refusal": answer.refusal}))
    else:
        print("\n".join([*map(as_line, answer.changed), *answer.shelf]) or "nothing changed")
        if answer.refusal:
            print(f"rigwatch: {answer.refusal}", file=sys.stderr)
    return 0 if answer.changed or answer.shelf else 1


def command_of(arguments: argparse.Namespace, user: str) -> "AlarmCommand":
    """The command of an operator.

    Raises:
        RigwatchError: the alarm to be shelved is not named.
    """
    from rigwatch.wire.errors import RigwatchError
    from rigwatch.wire.messages import EVERY_ALARM, AlarmCommand

    chosen = [one for one in ("reset", "shelve", "unshelve") if getattr(arguments, one)]
    action = chosen[0] if chosen else "acknowledge"
    if action.endswith("shelve") and not arguments.name:
        raise RigwatchError(f"--{action}: found no alarm, expected the NAME of one")
    name = arguments.name or EVERY_ALARM
    return AlarmCommand(name, action, user, time.time_ns(), arguments.text)  # type: ignore[arg-type]
