"""Everything on the bus that is worth keeping: samples without a hole, the rest as it comes."""

from rigwatch.wire.bus import Bus
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.messages import RUN, SAMPLES, TOPICS, Event, Gap, Message, SampleBlock

_SUBSCRIBED = tuple(line for line in TOPICS if line.recorded and line not in (SAMPLES, RUN))


class Feed:
    """The recorded topics of the bus.

    Args:
        bus: where they are; what `bus.process` itself says is not taken from there.
        resume_after: (boot, seq) of the last sample that an earlier run of this recorder has kept,
            so that those in between are fetched from the ring.

    Attributes:
        samples: samples delivered.
        gap_samples: samples reported as lost, by this reader.
    """

    def __init__(self, bus: Bus, resume_after: tuple[int, int] | None = None) -> None:
        self.samples = self.gap_samples = 0
        self._name = bus.process
        self._reader = SampleReader(bus, resume_after)
        self._others = [bus.subscribe(line) for line in _SUBSCRIBED]

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
        return found

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
