"""Everything on the bus that is worth keeping: samples without a hole, the rest as it comes."""

from rigwatch.recorder.positions import Positions
from rigwatch.wire.bus import Bus, CompleteSubscription, Subscription
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.messages import RUN, SAMPLES, TOPICS, Event, Gap, Message, SampleBlock

_SUBSCRIBED = tuple(line for line in TOPICS if line.recorded and line not in (SAMPLES, RUN))


class Feed:
    """The recorded topics of the bus.

    Args:
        bus: where they are; what `bus.process` itself says is not taken from there.
        resume_after: (boot, seq) of the last sample that an earlier run of this recorder has kept,
            so that those in between are fetched from the ring.
        positions: the same of numbered topics.

    Attributes:
        samples: samples delivered.
        gap_samples: samples reported as lost, by this reader.
    """

    def __init__(
        self,
        bus: Bus,
        resume_after: tuple[int, int] | None = None,
        positions: Positions | None = None,
    ) -> None:
        self.samples = self.gap_samples = 0
        self._name = bus.process
        self._reader = SampleReader(bus, resume_after)
        resumed = positions or {}
        self._numbered = {
            line.name: bus.listen(line, resumed.get(line.name))
            for line in _SUBSCRIBED
            if line.numbered
        }
        others = [bus.subscribe(line) for line in _SUBSCRIBED if not line.numbered]
        self._others: list[Subscription] = [*others, *self._numbered.values()]

    def take(self) -> list[Message]:
        """What has come since the last call; does not wait."""
        found: list[Message] = list(self._reader.read(0.0))
        for item in found:
            if isinstance(item, SampleBlock):
                self.samples += len(item)
            elif isinstance(item, Gap):
                self.gap_samples += max(0, item.last - item.first + 1)
        for subscription in self._others:
            found += [message for message in subscription.drain() if not self._is_own(message)]
            if isinstance(subscription, CompleteSubscription):
                found += subscription.reports()
        return found

    def positions(self) -> Positions:
        """How far the numbered topics have been taken."""
        return {name: listened.positions() for name, listened in self._numbered.items()}

    def lost(self, topic: str) -> int:
        """Messages of a numbered topic that are known to be gone."""
        return self._numbered[topic].lost

    def _is_own(self, message: Message) -> bool:
        """Gaps and events that the reader published, and returned above as well."""
        if isinstance(message, Gap):
            return message.reporter == self._name
        return isinstance(message, Event) and message.source == self._name

    @property
    def rejected(self) -> int:
        """Payloads that were no messages of their topic."""
        return self._reader.rejected + sum(item.rejected for item in self._others)

    @property
    def dropped(self) -> int:
        """Messages other than samples that came faster than they were taken."""
        return sum(item.dropped for item in self._others)

    def close(self) -> None:
        """Take no more."""
        self._reader.close()
        for subscription in self._others:
            subscription.close()
