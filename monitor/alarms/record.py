"""Persistent record of an alarm, from which a restarted monitor restores its state."""

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
