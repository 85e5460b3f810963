"""What an operator's command means: which alarms it is for, and why it may be refused."""

from collections.abc import Iterable

from monitor.alarms.kinds import split
from monitor.alarms.state import UNSEEN, AlarmInstance
from rigwatch.wire.messages import AlarmCommand

EVERY = "*"


def wanted(command: AlarmCommand, alarms: Iterable[AlarmInstance]) -> list[AlarmInstance]:
    """The alarms meant: one, all channels of a kind, or with "*" all that the action can change."""
    alarms = list(alarms)
    if command.name == EVERY:
        return [alarm for alarm in alarms if not obstacle(command, alarm)]
    return [alarm for alarm in alarms if command.name in {alarm.name, split(alarm.name)[0]}]


def refusal(command: AlarmCommand, found: list[AlarmInstance]) -> str:
    """One plain line saying why nothing is done; "" where the command can be obeyed."""
    if not command.user:
        return f"{command.action} of {command.name} refused: nobody is named as its user"
    if command.name == EVERY:
        return ""
    if not found:
        return f"{command.action} of {command.name} refused: no such alarm has been seen"
    obstacles = [obstacle(command, alarm) for alarm in found]
    return f"{command.action} of {command.name} refused: {obstacles[0]}" if all(obstacles) else ""


def obstacle(command: AlarmCommand, alarm: AlarmInstance) -> str:
    """What stands between one alarm and the command; "" for nothing."""
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
