"""Messages onto the bus and samples into the ring; never waits for a reader."""

from collections.abc import Iterable

from rigwatch.wire.bus import Bus
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.messages import (
    EVENTS,
    GAPS,
    HEALTH,
    SAMPLES,
    Event,
    Gap,
    Health,
    Message,
    SampleBlock,
    Topic,
)

_TOPICS: dict[type[Message], Topic] = {
    SampleBlock: SAMPLES,
    Gap: GAPS,
    Event: EVENTS,
    Health: HEALTH,
}


class Publisher:
    """Says what the acquisition has to say.

    Args:
        bus: where it is said.
        ring: where samples are kept, served on the bus.
    """

    def __init__(self, bus: Bus, ring: SampleRing) -> None:
        self._bus = bus
        self._ring = ring

    def publish(self, messages: Iterable[Message]) -> None:
        """Publish messages in order; samples go into the ring first, to be there when asked for."""
        for message in messages:
            if isinstance(message, SampleBlock):
                self._ring.add(message)
            self._bus.publish(_TOPICS[type(message)], message)
