"""Sends operator commands for alarms to a running monitor."""

import time
from dataclasses import dataclass, field

from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.commands.alarm_list import ask_alarm_list, no_monitor
from rigwatch.wire.bus.commands.command_check import signed
from rigwatch.wire.bus.commands.refusal import refusal_of
from rigwatch.wire.bus.message_ring import SAID_KEY
from rigwatch.wire.bus.subscription import Subscription
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import (
    ALARMS,
    COMMANDS,
    EVENTS,
    EVERY_ALARM,
    MONITOR_STALE,
    Alarm,
    AlarmCommand,
)

TIMEOUT = 3.0
SHELF = ("alarm_shelved", "alarm_unshelved")
"""Codes of the events that tell what operators do to the shelf."""
SETTLE = 0.2
"""Time for further answers after the first [s]."""


@dataclass
class CommandAnswer:
    """What the monitor said to one command.

    Attributes:
        changed: the transitions.
        shelf: what was put on the shelf or taken off it, a line each.
        refusal: why nothing happens.
        interrupted: the link was down meanwhile, so that command or answer may be lost.
    """

    changed: list[Alarm] = field(default_factory=list)
    shelf: list[str] = field(default_factory=list)
    refusal: str = ""
    interrupted: bool = False

    def __bool__(self) -> bool:
        return bool(self.changed or self.shelf or self.refusal)


def command_alarms(bus: Bus, command: AlarmCommand) -> CommandAnswer:
    """Sign and send a command, and collect what is said to it.

    A command that may have been lost with the link, as when the router opens anew, or with a
    monitor that has started anew meanwhile, is sent again.

    Raises:
        BusError: no monitor answers.
        KeysError: the operator's key cannot be read.
    """
    changes, events = bus.subscribe(ALARMS), bus.subscribe(EVENTS)
    try:
        there = _monitors(bus)
        answer = _answer_to(bus, command, changes, events)
        if not answer and (answer.interrupted or _monitors(bus) != there):
            answer = _answer_to(bus, command, changes, events)
        if not answer and not _monitors(bus):
            raise no_monitor(bus)
        return answer
    finally:
        changes.close()
        events.close()


def _answer_to(
    bus: Bus, command: AlarmCommand, changes: Subscription, events: Subscription
) -> CommandAnswer:
    _wait_for_monitor(bus, command)
    sent = signed(bus, command)
    bus.publish(COMMANDS, sent)
    answer = CommandAnswer()
    deadline = time.monotonic() + TIMEOUT / 2
    while time.monotonic() < deadline and not answer.refusal:
        alarm = changes.get(timeout=0.05)
        said = events.drain()
        shelf = [one.text for one in said if one.code in SHELF and command.user in one.text]
        own = [alarm] if alarm is not None and alarm.user == command.user else []
        answer.changed += own
        answer.shelf += shelf
        if own or shelf:
            deadline = min(deadline, time.monotonic() + SETTLE)
        answer.refusal = refusal_of(sent, said)
        answer.interrupted |= not bus.connected()
    return answer


def _wait_for_monitor(bus: Bus, command: AlarmCommand) -> None:
    deadline = time.monotonic() + TIMEOUT
    # The witness, which has an alarm of its own, answers for the list without a monitor too.
    alone = command.name in (MONITOR_STALE, EVERY_ALARM)
    while True:
        try:
            ask_alarm_list(bus, TIMEOUT)
            if alone or _monitors(bus):
                return
            raise no_monitor(bus)
        except BusError:
            if time.monotonic() > deadline:
                raise
            time.sleep(SETTLE)


def _monitors(bus: Bus) -> frozenset[tuple[str, str | None]]:
    """The runs of the monitor that are there; one that has started anew is another."""
    return frozenset(bus.names(f"{SAID_KEY}/monitor"))
