"""The newest of each alarm and process, in bounded memory: a name costs a stranger nothing."""

from collections.abc import Collection, Iterable
from dataclasses import replace

from rigwatch.wire.messages.message_types import Alarm

MOST_ALARMS = 2048
"""Alarms that are remembered; a rig of 64 channels has a third of that."""
MOST_SOURCES, MOST_FIGURES = 32, 100
"""Processes whose health is remembered, the first that are heard, and figures of one."""


def remember(alarms: dict[str, Alarm], alarm: Alarm) -> None:
    """Put an alarm's newest change into `alarms`; if they are too many, forget the oldest.

    Those whose condition is over and seen go first.
    """
    alarms.pop(alarm.name, None)
    alarms[alarm.name] = alarm
    if len(alarms) > MOST_ALARMS:
        over = (name for name, one in alarms.items() if one.state == "normal")
        del alarms[next(over, next(iter(alarms)))]


def is_remembered(known: Collection[str], source: str) -> bool:
    """Whether the health of a process joins that of those that are known."""
    return source in known or len(known) < MOST_SOURCES


def transitions(alarms: Iterable[Alarm]) -> list[Alarm]:
    """The changes of state, each with the value and the cause that were told last in it.

    A standing alarm is told again where its value has become better, and by a monitor that was
    restarted.

    Args:
        alarms: as they were told, in order.
    """
    found: list[Alarm] = []
    places: dict[str, int] = {}
    for alarm in alarms:
        place = places.get(alarm.name)
        if place is not None and told_again(found[place], alarm):
            found[place] = replace(
                found[place], value=alarm.value, low=alarm.low, high=alarm.high, cause=alarm.cause
            )
            continue
        places[alarm.name] = len(found)
        found.append(alarm)
    return found


def told_again(before: Alarm, now: Alarm) -> bool:
    """Whether an alarm stands as it did, since the same sample."""
    own = (now.device, now.boot, now.onset_seq, now.state, now.user)
    return own == (before.device, before.boot, before.onset_seq, before.state, before.user)
