"""Operator commands: the alarms that they address, and reasons for refusing them."""

from collections.abc import Iterable
from dataclasses import replace

from monitor.alarms.kinds import split
from monitor.alarms.state import UNSEEN, AlarmInstance
from rigwatch.wire.messages import EVERY_ALARM, LONGEST_NAME, LONGEST_TEXT, AlarmCommand

MAX_CLOCK_DIFFERENCE_NS = 60_000_000_000
"""Largest difference between a command's time and the monitor's; beyond it, it is wrong [ns]."""


def bounded(command: AlarmCommand, now_ns: int) -> AlarmCommand:
    """The command with bounded texts and a valid time.

    Args:
        command: as received.
        now_ns: the monitor's Unix time, used if the command's is far off [ns].
    """
    wrong_clock = abs(command.t_ns - now_ns) > MAX_CLOCK_DIFFERENCE_NS
    return replace(
        command,
        name=_shortened(command.name, LONGEST_NAME),
        user=_shortened(command.user, LONGEST_NAME),
        text=_shortened(command.text, LONGEST_TEXT),
        t_ns=now_ns if wrong_clock else command.t_ns,
    )


def _shortened(text: str, longest: int) -> str:
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def addressed(command: AlarmCommand, alarms: Iterable[AlarmInstance]) -> list[AlarmInstance]:
    """The alarms addressed: one, all channels of a kind, or with "*" all that can be changed."""
    alarms = list(alarms)
    if command.name == EVERY_ALARM:
        return [alarm for alarm in alarms if not obstacle(command, alarm)]
    return [alarm for alarm in alarms if command.name in {alarm.name, split(alarm.name)[0]}]


def refusal(command: AlarmCommand, found: list[AlarmInstance]) -> str:
    """Why the command is refused, in one line; "" if it can be executed."""
    if not command.user:
        return f"{command.action} of {command.name} refused: no user given"
    if command.name == EVERY_ALARM:
        return ""
    if not found:
        return f"{command.action} of {command.name} refused: no such alarm has been seen"
    obstacles = [obstacle(command, alarm) for alarm in found]
    return f"{command.action} of {command.name} refused: {obstacles[0]}" if all(obstacles) else ""


def obstacle(command: AlarmCommand, alarm: AlarmInstance) -> str:
    """Why the command cannot be applied to one alarm; "" if it can."""
    if command.action == "acknowledge":
        return "" if alarm.state in UNSEEN else f"it is {alarm.state}"
    if command.action == "reset":
        if alarm.active:
            return "its condition still holds"
        return "" if alarm.latched else "it is not latched"
    if command.action == "unshelve":
        return "" if alarm.shelved_until_ns else "it is not shelved"
    if alarm.kind.severity == "critical":
        return "critical alarms cannot be shelved"
    return "it is shelved already" if alarm.shelved_until_ns else ""
