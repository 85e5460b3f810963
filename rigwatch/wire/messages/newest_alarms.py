"""The newest change of each alarm, in bounded memory: a name costs a stranger nothing."""

from rigwatch.wire.messages.message_types import Alarm

MOST_ALARMS = 2048
"""Alarms that are remembered; a rig of 64 channels has a third of that."""


def remember(alarms: dict[str, Alarm], alarm: Alarm) -> None:
    """Put an alarm's newest change into `alarms`; if they are too many, forget the oldest.

    Those whose condition is over and seen go first.
    """
    alarms.pop(alarm.name, None)
    alarms[alarm.name] = alarm
    if len(alarms) > MOST_ALARMS:
        over = (name for name, one in alarms.items() if one.state == "normal")
        del alarms[next(over, next(iter(alarms)))]
