"""What the bus says, as far as it is drawn: a bounded queue a topic, emptied a few times a second.

A screen may leave something out, so that nothing is asked of anybody twice: what a full queue
drops is counted and shown.
"""

from rigwatch.wire.bus import Bus, ask_alarm_list
from rigwatch.wire.errors import BusError
from rigwatch.wire.messages import (
    ALARMS,
    ESTIMATES,
    EVENTS,
    GAPS,
    HEALTH,
    RUN,
    SAMPLES,
    Alarm,
    Message,
)

_DRAWN = (RUN, SAMPLES, ESTIMATES, ALARMS, GAPS, HEALTH, EVENTS)
_ASK_TIMEOUT = 0.5
_CAPACITY = 2048
"""Messages a topic: eight seconds of one message a sample."""


class Feed:
    """Everything that the dashboard draws, from one bus.

    Args:
        bus: where the rig's processes speak.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._subscriptions = [bus.subscribe(topic, _CAPACITY) for topic in _DRAWN]

    def drain(self) -> list[Message]:
        """All that waits, topic by topic; within a topic the oldest first."""
        return [message for waiting in self._subscriptions for message in waiting.drain()]

    def standing(self) -> list[Alarm]:
        """Alarms that were raised before anybody looked; none where no monitor answers."""
        try:
            return ask_alarm_list(self._bus, _ASK_TIMEOUT)
        except BusError:
            return []

    @property
    def skipped(self) -> int:
        """Messages that were dropped because drawing was too slow."""
        return sum(waiting.dropped for waiting in self._subscriptions)

    def close(self) -> None:
        """Listen no more."""
        for waiting in self._subscriptions:
            waiting.close()
