"""The recorded topics of the bus: complete samples and numbered messages, others as received."""

import time

from rigwatch.recorder.positions import Positions
from rigwatch.wire.bus import Bus, CompleteSubscription, Subscription
from rigwatch.wire.delivery import SampleReader
from rigwatch.wire.messages import (
    ALARMS,
    GAPS,
    RECORDERS,
    RUN,
    SAMPLES,
    TOPICS,
    Event,
    Gap,
    Message,
    SampleBlock,
    is_source,
)

_SUBSCRIBED = tuple(line for line in TOPICS if line.recorded and line not in (SAMPLES, RUN))
CATCH_UP = 0.25
"""Longest time in a turn for messages of the rings, which come a second's worth at a time [s]."""
PROVED_WITHIN, MOST_UNPROVED = 2.0, 256
"""Time within which the token of a process that reports a gap is known [s], and how many wait."""


class Feed:
    """The recorded topics of the bus.

    Args:
        bus: source of the messages; those of `bus.process` itself are ignored.
        resume_after: (boot, seq) of the last sample stored by an earlier run of this recorder;
            later ones are fetched from the ring.
        positions: the same for numbered topics.
        gaps_may_fill: do not publish gaps yet, as another recording may fill them.
        catch_up: longest time in a turn for messages of the rings [s].

    Attributes:
        samples: samples delivered.
        gap_samples: samples reported as lost, by this reader.
        foreign_gaps: reports in the name of daq, monitor or a recorder that were not theirs.
    """

    def __init__(
        self,
        bus: Bus,
        resume_after: tuple[int, int] | None = None,
        positions: Positions | None = None,
        *,
        gaps_may_fill: bool = False,
        catch_up: float = CATCH_UP,
    ) -> None:
        self._catch_up = catch_up
        self.samples = self.gap_samples = self.foreign_gaps = 0
        self._name = bus.process
        here = not gaps_may_fill
        self._reader = SampleReader(bus, resume_after, publish_gaps=here, patient=here)
        resumed = positions or {}
        self._numbered = {
            line.name: bus.listen(
                line,
                resumed.get(line.name),
                gaps_in_place=True,
                publish_gaps=here,
                patient=here,
            )
            for line in _SUBSCRIBED
            if line.numbered
        }
        self._unproved: list[tuple[float, Gap, str]] = []
        self._of_recorder = bus.subscribe_own(GAPS, RUN.publisher)
        # Gaps last: those before show who may report some.
        others = [
            bus.subscribe(line) for line in _SUBSCRIBED if not (line.numbered or line is GAPS)
        ]
        self._others: list[Subscription] = [
            *others,
            *self._numbered.values(),
            bus.subscribe_own(GAPS, ""),
            self._of_recorder,
        ]

    def take(self) -> list[Message]:
        """Messages received since the last call; does not wait."""
        found = self._counted(self._samples())
        for subscription in self._others:
            found += self._drained(subscription)
            if isinstance(subscription, CompleteSubscription):
                found += subscription.reports()
        return found

    def rest(self) -> list[Message]:
        """What was taken and still waits, at the end."""
        return []

    def _samples(self) -> list[Message]:
        return [*self._reader.read(0.0)]

    def _counted(self, found: list[Message]) -> list[Message]:
        for item in found:
            if isinstance(item, SampleBlock):
                self.samples += len(item)
            elif isinstance(item, Gap) and not item.topic:
                self.gap_samples += max(0, item.last - item.first + 1)
        return found

    def _drained(self, subscription: Subscription) -> list[Message]:
        if isinstance(subscription, CompleteSubscription):
            return subscription.catch_up(self._catch_up)  # its own gaps are in their place
        if subscription.topic is GAPS:
            return self._credible(subscription)
        return [message for message in subscription.drain() if not self._is_own(message)]

    def _credible(self, subscription: Subscription) -> list[Message]:
        """Reports of losses by others, without those in the name of a process that is not theirs.

        `rigwatch info` believes those of recorders, daq and monitor.
        """
        found: list[Message] = []
        for gap, sender in subscription.drain_from():
            if self._is_own(gap):
                continue
            if gap.reporter not in RECORDERS:
                self._unproved.append((time.monotonic(), gap, sender))
            elif self._is_of_site(gap, subscription):
                found.append(gap)
            else:
                self.foreign_gaps += 1
        return [*found, *self._proved()]

    def _is_of_site(self, gap: Gap, subscription: Subscription) -> bool:
        """Whether a report comes from the site's recorder, and matters.

        What another recorder lacks says nothing of this recording; a remote one has the reports of
        its site's. Those come at a key that a bus with keys denies to everybody else.
        """
        return gap.reporter == RUN.publisher and subscription is self._of_recorder

    def _proved(self) -> list[Message]:
        """The waiting reports that come from the processes that they name, as far as known."""
        found: list[Message] = []
        now, waiting = time.monotonic(), self._unproved
        self._unproved = []
        for at, gap, sender in waiting:
            if self._is_by(gap, sender):
                found.append(gap)
            elif now - at < PROVED_WITHIN and len(self._unproved) < MOST_UNPROVED:
                self._unproved.append((at, gap, sender))
            else:
                self.foreign_gaps += 1
        return found

    def _is_by(self, gap: Gap, sender: str) -> bool:
        """Whether a report comes from the process that it names, as far as that matters."""
        if gap.reporter == ALARMS.publisher:
            alarms = self._numbered[ALARMS.name]
            return alarms.is_process(gap.reporter, sender)
        return not is_source(gap.reporter) or self._reader.is_source(gap.boot, sender)

    def positions(self) -> Positions:
        """Positions in the numbered topics."""
        return {name: listened.positions() for name, listened in self._numbered.items()}

    def figures(self) -> dict[str, float]:
        """Further figures for the recorder's health."""
        return {}

    def lost(self, topic: str) -> int:
        """Messages of numbered topics known to be lost."""
        return self._numbered[topic].lost

    def _is_own(self, message: Message) -> bool:
        """Whether a message was published by this reader, which also returned it."""
        if isinstance(message, Gap):
            return message.reporter == self._name
        return isinstance(message, Event) and message.source == self._name

    @property
    def rejected(self) -> int:
        """Payloads that were not valid messages of their topic."""
        return self._reader.rejected + sum(item.rejected for item in self._others)

    @property
    def dropped(self) -> int:
        """Messages, other than samples, dropped because the recorder was slow."""
        return sum(item.dropped for item in self._others)

    @property
    def foreign(self) -> int:
        """Alarms, estimates and model changes dropped because they were not their sender's."""
        return sum(item.foreign for item in self._numbered.values())

    @property
    def foreign_samples(self) -> int:
        """Samples dropped because their source has no control, or they were not their sender's."""
        return self._reader.counters.foreign

    @property
    def refused(self) -> int:
        """Messages of clients that sent more than their share."""
        return sum(item.refused for item in self._others)

    def close(self) -> None:
        """Stop receiving."""
        self._reader.close()
        for subscription in self._others:
            subscription.close()
