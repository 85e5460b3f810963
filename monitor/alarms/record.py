"""Persistent record of an alarm, from which a restarted monitor restores its state."""

from collections.abc import Sequence
from dataclasses import dataclass

from rigwatch.wire.messages import Alarm


@dataclass(frozen=True, slots=True)
class AlarmRecord:
    """One alarm after one transition.

    Attributes:
        alarm: the transition as published (or, in a flood, as it would have been).
        active: whether the condition holds, after persistence and hysteresis.
        latched: whether an operator must still reset the alarm.
        shelved_until_ns: end of shelving, Unix time [ns]; 0 if not shelved.
        grouped: whether it is hidden in a flood.
        text: the operator's text, or the reason for the transition.
    """

    alarm: Alarm
    active: bool
    latched: bool
    shelved_until_ns: int
    grouped: bool
    text: str


RETOLD_NS = 10_000_000_000
"""Time before the newest transition for which returns to normal are told again [ns]."""


def just_returned(records: Sequence[AlarmRecord]) -> list[Alarm]:
    """The last returns to normal: a kill between journal and delivery leaves them unheard.

    The standing alarms are told again anyway; without these a listener would keep an alarm that
    is over. Who has heard them hears the same state once more.

    Args:
        records: the newest of each alarm.
    """
    newest = max((one.alarm.t_ns for one in records), default=0)
    return [
        one.alarm
        for one in records
        if one.alarm.state == "normal" and not one.grouped and newest - one.alarm.t_ns <= RETOLD_NS
    ]
