"""The drawn messages of the bus: a bounded queue per topic, emptied a few times a second.

A screen may skip messages, so nothing is requested again: what a full queue drops is counted and
shown. Alarms are the exception: missed ones are requested from the monitor.
"""

import time
from dataclasses import replace

from rigwatch.wire.bus import Bus, ShelvedAlarm, Subscription, ask_alarm_list, ask_shelf
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    EVENTS,
    GAPS,
    HEALTH,
    RUN,
    SAID_BY_ANYBODY,
    SAMPLES,
    Alarm,
    Message,
)

_DRAWN = (RUN, SAMPLES, ESTIMATES, ALARMS, GAPS, HEALTH, EVENTS)
_ASK_TIMEOUT = 0.5
_CAPACITY = 2048
"""Messages per topic: eight seconds at one message per sample."""


class Feed:
    """Everything that the dashboard draws, from one bus.

    Args:
        bus: the rig's bus.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._alarms = bus.listen(ALARMS, capacity=_CAPACITY)
        self._subscriptions: list[Subscription] = [
            self._alarms if topic is ALARMS else bus.subscribe_lossy(topic, _CAPACITY)
            for topic in _DRAWN
        ]

    def drain(self) -> list[Message]:
        """All waiting messages, topic by topic; within a topic oldest first."""
        now_ns = time.time_ns()
        found = (message for waiting in self._subscriptions for message in waiting.drain())
        return [_at_the_latest(message, now_ns) for message in found]

    def standing(self) -> list[Alarm]:
        """Alarms raised before this start; none if no monitor answers."""
        try:
            return ask_alarm_list(self._bus, _ASK_TIMEOUT)
        except BusError:
            return []

    def shelf(self) -> list[ShelvedAlarm] | None:
        """The shelved alarms, which stand nowhere else; None if no monitor answers."""
        try:
            return ask_shelf(self._bus, _ASK_TIMEOUT)
        except BusError:
            return None

    @property
    def skipped(self) -> int:
        """Messages dropped because drawing was too slow."""
        return sum(waiting.dropped for waiting in self._subscriptions)

    @property
    def lost_alarms(self) -> int:
        """Alarms that were said and will never be known."""
        return self._alarms.lost

    def close(self) -> None:
        """Close the subscriptions."""
        for waiting in self._subscriptions:
            waiting.close()


def _at_the_latest(message: Message, now_ns: int) -> Message:
    """What any client may say, drawn now at the latest.

    The screen follows the newest time that is drawn: a message dated ahead would leave it empty.
    """
    if isinstance(message, SAID_BY_ANYBODY) and message.t_ns > now_ns:
        return replace(message, t_ns=now_ns)
    return message
