"""The bus between the processes of a rig: messages, queries and liveliness.

    Bus             used by processes: a Member, which encodes and checks messages, that also hears
     └ Transport    carries the bytes: Zenoh, or memory (`zenoh_transport`, `memory_transport`)

Publishing never waits for a reader: if a reader or the link is too slow, messages are dropped, and
readers that need every message fetch missing ones from a ring (`message_ring.py`, `ring.py`). A
receiving callback only puts bytes into a bounded queue; they are decoded in the reader's thread, so
an invalid message is counted there without further effect.
"""

from collections.abc import Iterable, Mapping

from rigwatch.wire.bus.complete_subscription import CompleteSubscription, Place
from rigwatch.wire.bus.member import Member
from rigwatch.wire.bus.subscription import QUEUE_CAPACITY, Subscription
from rigwatch.wire.messages import Topic


class Bus(Member):
    """One process's connection to the bus of one rig."""

    def subscribe(self, topic: Topic, capacity: int = QUEUE_CAPACITY) -> Subscription:
        """The topic's messages from now on; for a numbered topic all, once each and in order."""
        if topic.numbered:
            return self.listen(topic, capacity=capacity)
        return self.subscribe_lossy(topic, capacity)

    def listen(
        self,
        topic: Topic,
        resume_after: Mapping[str, Place] | None = None,
        capacity: int = QUEUE_CAPACITY,
        *,
        gaps_in_place: bool = False,
        publish_gaps: bool = True,
        patient: bool = False,
    ) -> CompleteSubscription:
        """The messages of a numbered topic, after those that an earlier run has processed."""
        return CompleteSubscription(
            self,
            topic,
            capacity,
            resume_after,
            gaps_in_place=gaps_in_place,
            publish_gaps=publish_gaps,
            patient=patient,
        )

    def subscribe_lossy(self, topic: Topic, capacity: int = QUEUE_CAPACITY) -> Subscription:
        """The topic's messages as received; some may be lost, which suits e.g. a display."""
        return self._subscribed(topic, topic.keys, capacity)

    def subscribe_own(self, topic: Topic, process: str) -> Subscription:
        """The messages at the topic's key of `process`, at which only its role may send.

        That is so if the bus has keys. Processes without a key of their own share one.
        """
        return self._subscribed(topic, (topic.key_of(process),), QUEUE_CAPACITY)

    def _subscribed(self, topic: Topic, keys: Iterable[str], capacity: int) -> Subscription:
        found = Subscription(topic, capacity)
        for key in keys:
            # Of what is frequent, more may be lost among other rigs' than this reader counts.
            if topic.joined and topic.is_rare:
                found.follow(*self.transport.listen_among(self.rig, key, found.receive))
            else:
                found.follow(None, self.transport.listen_from(self.key(key), found.receive))
        return found
