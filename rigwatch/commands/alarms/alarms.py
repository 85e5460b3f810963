"""`rigwatch alarms`: lists the active alarms of a rig and the shelved ones, or follows changes."""

import argparse
import contextlib
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigwatch.wire.bus import Bus, Subscription
    from rigwatch.wire.messages import Alarm

HELP = "list a rig's alarms, or follow them"
EXAMPLE = """  rigwatch alarms configs/demo.toml
  rigwatch alarms configs/demo.toml --shelved
  rigwatch alarms configs/demo.toml --follow --json"""
TIMEOUT = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="configuration of the rig")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--follow", action="store_true", help="continue with every change")
    what.add_argument(
        "--shelved",
        action="store_true",
        help="only the alarms that were shelved: until when, by whom, and why",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the alarms; 0 whatever their number."""
    from rigwatch.wire.bus import ask_alarm_list, connect, unique_process
    from rigwatch.wire.messages import ALARMS, json_fields
    from rigwatch.wire.rig_config import load_rig

    bus = connect(load_rig(arguments.config), unique_process("alarms"), TIMEOUT)
    try:
        if arguments.shelved:
            _print_shelf(bus, arguments.json)
            return 0
        changes = bus.subscribe(ALARMS) if arguments.follow else None
        standing = ask_alarm_list(bus, TIMEOUT)
        if changes is not None:
            _follow(standing, changes, arguments.json)
        elif arguments.json:
            print(json.dumps([json_fields(alarm) for alarm in standing], indent=2))
        else:
            told = "\n\n".join(as_text(alarm, arguments.config) for alarm in standing)
            print(told or "no active alarms")
            _print_shelved(bus)
    finally:
        bus.close()
    return 0


def _print_shelf(bus: "Bus", as_json: bool) -> None:
    from rigwatch.wire.bus import ask_shelf, shelf_line

    shelved = ask_shelf(bus, TIMEOUT)
    if as_json:
        print(json.dumps([asdict(one) for one in shelved], indent=2))
    else:
        print("\n".join(map(shelf_line, shelved)) or "no shelved alarms")


def _print_shelved(bus: "Bus") -> None:
    """What is not announced, below what is; nothing where only the witness is there to answer."""
    from rigwatch.wire.bus import ask_shelf, shelf_line
    from rigwatch.wire.errors import BusError

    with contextlib.suppress(BusError):
        for one in ask_shelf(bus, TIMEOUT):
            print(shelf_line(one))


def _follow(standing: "list[Alarm]", changes: "Subscription", as_json: bool) -> None:
    for alarm in standing:
        _print_line(alarm, as_json)
    print("following; Ctrl-C ends", file=sys.stderr)
    while True:
        alarm = changes.get(timeout=0.5)
        if alarm is not None:
            _print_line(alarm, as_json)


def _print_line(alarm: "Alarm", as_json: bool) -> None:
    from rigwatch.wire.messages import json_fields

    print(json.dumps(json_fields(alarm)) if as_json else as_line(alarm), flush=True)


def as_line(alarm: "Alarm") -> str:
    """One line: time, severity, name, state."""
    from datetime import datetime

    from rigwatch.wire.messages import PROVED

    when = datetime.fromtimestamp(alarm.t_ns / 1e9).astimezone()
    mark = " FIRST OUT" if alarm.first_out and alarm.state != "normal" else ""
    proved = " (proved)" if alarm.identity == PROVED else ""
    who = f" by {alarm.user}{proved}" if alarm.user else ""
    state = alarm.state.replace("_", " ")
    return f"{when:%Y-%m-%d %H:%M:%S} {alarm.severity:8} {alarm.name}: {state}{who}{mark}"


def as_text(alarm: "Alarm", config: Path) -> str:
    """The alarm with its cause, and its guidance with the rig's file in the commands."""
    return f"{as_line(alarm)}\n    {alarm.cause}\n    {alarm.guidance_for(str(config))}"
