"""Publishes messages on the bus and keeps samples in the ring; never waits for a reader."""

from collections.abc import Iterable

from rigwatch.wire.bus import Bus
from rigwatch.wire.delivery import SampleRing
from rigwatch.wire.messages import SAMPLES, Message, SampleBlock, topic_of


class Publisher:
    """Publishes the acquisition's messages.

    Args:
        bus: the bus.
        ring: holds samples and serves them on the bus.
    """

    def __init__(self, bus: Bus, ring: SampleRing) -> None:
        self._bus = bus
        self.ring = ring

    def publish(self, messages: Iterable[Message]) -> None:
        """Publish messages in order; samples go into the ring first, ready for queries."""
        for message in messages:
            if isinstance(message, SampleBlock):
                self.ring.add(message)
            self._bus.publish(topic_of(message), message)

    def publish_kept(self, payload: bytes) -> None:
        """Publish the bytes of samples that are in the ring already."""
        self._bus.publish_encoded(SAMPLES, payload)
