"""Sends operator commands for alarms to a running monitor."""

import time

from rigwatch.wire.bus.alarm_list import ask_alarm_list
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.command_check import signed
from rigwatch.wire.messages import ALARMS, COMMANDS, EVENTS, Alarm, AlarmCommand

TIMEOUT = 3.0
SETTLE = 0.2
"""Time for further answers after the first [s]."""


def command_alarms(bus: Bus, command: AlarmCommand) -> tuple[list[Alarm], str]:
    """Sign and send a command; the transitions in the monitor's reply, and the reason of a refusal.

    Raises:
        BusError: no monitor answers.
        KeysError: the operator's key cannot be read.
    """
    changes, events = bus.subscribe(ALARMS), bus.subscribe(EVENTS)
    try:
        ask_alarm_list(bus, TIMEOUT)
        bus.publish(COMMANDS, signed(bus, command))
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
    finally:
        changes.close()
        events.close()
