"""`rigwatch ack`: say that an alarm has been seen, or reset one whose cause is gone."""

import argparse
import getpass
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigwatch.wire.bus import Bus, Subscription
    from rigwatch.wire.messages import Alarm, AlarmCommand

HELP = "acknowledge or reset alarms of a rig"
EXAMPLE = """  rigwatch ack configs/demo.toml --user ann
  rigwatch ack configs/demo.toml dry_friction --user ann --reset"""
TIMEOUT = 3.0
SETTLE = 0.2
"""After the first answer, time for more of them [s]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")
    parser.add_argument("name", nargs="?", default="*", metavar="NAME", help="alarm; else all")
    parser.add_argument("--user", default="", help="who acts; else the user logged in")
    parser.add_argument("--reset", action="store_true", help="release the latch, once seen")
    parser.add_argument("--text", default="", help="remark kept in the journal")


def run(arguments: argparse.Namespace) -> int:
    """Send the command and print what it changed; 1 where it changed nothing."""
    from rigwatch.commands.alarms.alarms import as_dict, as_line
    from rigwatch.wire.bus import ask_alarm_list, connect, unique_process
    from rigwatch.wire.messages import ALARMS, EVENTS
    from rigwatch.wire.rig_config import load_rig

    bus = connect(load_rig(arguments.config), unique_process("ack"), TIMEOUT)
    try:
        changes, events = bus.subscribe(ALARMS), bus.subscribe(EVENTS)
        ask_alarm_list(bus, TIMEOUT)
        changed, refusal = _send(bus, command_of(arguments), changes, events)
    finally:
        bus.close()
    if arguments.json:
        print(json.dumps({"changed": [as_dict(alarm) for alarm in changed], "refusal": refusal}))
    else:
        print("\n".join(as_line(alarm) for alarm in changed) or "nothing changed")
        if refusal:
            print(f"rigwatch: {refusal}", file=sys.stderr)
    return 0 if changed else 1


def command_of(arguments: argparse.Namespace) -> "AlarmCommand":
    """What the operator asks for."""
    from rigwatch.wire.messages import AlarmCommand

    action = "reset" if arguments.reset else "acknowledge"
    user = arguments.user or getpass.getuser()
    return AlarmCommand(arguments.name, action, user, time.time_ns(), arguments.text)  # type: ignore[arg-type]


def _send(
    bus: "Bus", command: "AlarmCommand", changes: "Subscription", events: "Subscription"
) -> "tuple[list[Alarm], str]":
    """The transitions that the monitor answers with, and why it refuses, if it does."""
    from rigwatch.wire.messages import COMMANDS

    bus.publish(COMMANDS, command)
    done: list[Alarm] = []
    refusal = ""
    deadline = time.monotonic() + TIMEOUT / 2
    while time.monotonic() < deadline and not refusal:
        alarm = changes.get(timeout=0.05)
        if alarm is not None and alarm.user == command.user:
            done.append(alarm)
            deadline = min(deadline, time.monotonic() + SETTLE)
        said = [event for event in events.drain() if event.code == "alarm_command_refused"]
        refusal = said[0].text if said else refusal
    return done, refusal
