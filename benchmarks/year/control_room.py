"""A listener and operator in a process of its own, so that it lives by the rig's clock.

    python -m benchmarks.year.control_room CONFIG

prints every alarm and event that it hears as a line of JSON, and obeys the lines `acknowledge` and
`reset`, for all alarms.
"""

import json
import sys
import threading
import time
from typing import Literal

from rigwatch.wire.bus import Bus, command_alarms, connect
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import ALARMS, EVENTS, Alarm, AlarmCommand, Event
from rigwatch.wire.rig_config import load_rig

Action = Literal["acknowledge", "reset"]
FIRST = 60.0
"""Longest start of the router [s]."""


def say(kind: str, **fields: object) -> None:
    """A line of JSON, in one piece: two threads speak."""
    sys.stdout.write(json.dumps({"kind": kind, "heard": time.time_ns(), **fields}) + "\n")
    sys.stdout.flush()


def obey(bus: Bus) -> None:
    """Execute the lines of standard input until it ends."""
    for line in sys.stdin:
        action: Action = "reset" if line.strip() == "reset" else "acknowledge"
        try:
            command = AlarmCommand("*", action, "control-room", time.time_ns())
            refused = command_alarms(bus, command).refusal
        except RigwatchError as error:
            say("answer", text=str(error))
        else:
            say("answer", text=str(refused or ""))


def hear(message: Alarm | Event) -> None:
    """Print what was heard."""
    if isinstance(message, Alarm):
        say("alarm", name=message.name, state=message.state, severity=message.severity,
            t=message.t_ns, text=message.cause)  # fmt: skip
    else:
        say("event", name=message.code, severity=message.severity, t=message.t_ns,
            text=message.text)  # fmt: skip


def main() -> None:
    """Listen until standard input ends."""
    bus = connect(load_rig(sys.argv[1]), "control-room", FIRST)
    alarms, events = bus.listen(ALARMS), bus.subscribe(EVENTS)
    operator = threading.Thread(target=obey, args=(bus,))
    operator.start()
    say("ready")
    while operator.is_alive():
        time.sleep(0.1)
        for message in [*alarms.drain(), *events.drain()]:
            hear(message)
        for report in alarms.reports():
            say("report", text=str(report))
    bus.close()


if __name__ == "__main__":
    main()
