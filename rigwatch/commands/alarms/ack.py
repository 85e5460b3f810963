"""`rigwatch ack`: acknowledges alarms, or resets those whose cause is gone."""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigwatch.wire.messages import AlarmCommand

HELP = "acknowledge or reset alarms of a rig"
EXAMPLE = """  rigwatch ack configs/demo.toml --user ann
  rigwatch ack configs/demo.toml dry_friction --user ann --reset"""
TIMEOUT = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")
    parser.add_argument("name", nargs="?", metavar="NAME", help="name of the alarm; default: all")
    parser.add_argument(
        "--user",
        default="",
        help="who acts; default: the operator of the certificate, or without keys the login name",
    )
    parser.add_argument(
        "--reset", action="store_true", help="reset latched alarms whose condition has gone"
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
        changed, refusal = command_alarms(bus, command)
    finally:
        bus.close()
    if arguments.json:
        print(
            json.dumps({"changed": [json_fields(alarm) for alarm in changed], "refusal": refusal})
        )
    else:
        print("\n".join(as_line(alarm) for alarm in changed) or "nothing changed")
        if refusal:
            print(f"rigwatch: {refusal}", file=sys.stderr)
    return 0 if changed else 1


def command_of(arguments: argparse.Namespace, user: str) -> "AlarmCommand":
    """The command of an operator."""
    from rigwatch.wire.messages import EVERY_ALARM, AlarmCommand

    action = "reset" if arguments.reset else "acknowledge"
    name = arguments.name or EVERY_ALARM
    return AlarmCommand(name, action, user, time.time_ns(), arguments.text)  # type: ignore[arg-type]
