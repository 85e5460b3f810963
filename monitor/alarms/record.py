"""What is remembered of an alarm, so that a restarted monitor stands where the old one stood."""

from dataclasses import dataclass

from rigwatch.wire.messages import Alarm


@dataclass(frozen=True, slots=True)
class AlarmRecord:
    """One alarm after one transition.

    Attributes:
        alarm: the transition as it was (or, in a flood, would have been) published.
        active: whether the condition holds, after persistence and hysteresis.
        latched: whether a person must still reset the alarm.
        shelved_until_ns: end of shelving, Unix time [ns]; 0 where it is not shelved.
        grouped: whether it stands hidden in a flood.
        text: what the operator wrote, or why there was a transition.
    """

    alarm: Alarm
    active: bool
    latched: bool
    shelved_until_ns: int
    grouped: bool
    text: str
