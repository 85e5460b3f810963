"""Alarms, events, health messages and the like that were missed while a site was cut off.

The messages received in the last minutes are known by their hashes. A message that a recording has
of the same time, and whose hash is not among them, was missed; each is added once.
"""

import hashlib
from collections import deque
from collections.abc import Iterable

from rigwatch.recorder.past.streams import Hole
from rigwatch.wire.messages import RECORDERS, Gap, Health, Message, decode, encode
from rigwatch.wire.session import Part, message_time

SITE = RECORDERS[0]
"""The site's process whose health message, sent each second, shows until when the link was up."""
MARGIN_NS = 3_000_000_000
"""Time asked for before and after an outage: topics may be delayed differently [ns]."""
KNOWN_NS = 300_000_000_000
"""Time for which messages are known [ns]."""
LATE_NS = 120_000_000_000
"""Time after an outage within which a gap is attributed to it [ns]."""


class Outage:
    """What was missed of all topics other than samples and estimates.

    Args:
        began: time at which an earlier run ended, an outage like any other [ns].

    Attributes:
        span: the span to ask for, None while there is none.
        filled: messages put in from recordings so far.
    """

    def __init__(self, began: int | None = None) -> None:
        self.span: Hole | None = None
        self.filled = 0
        self._began = began
        self._last: Hole | None = None
        self._back = began is not None
        self._heard = 0
        self._known: set[bytes] = set()
        self._order: deque[tuple[int, bytes]] = deque()
        self._gaps: list[Gap] = []

    def link(self, up: bool) -> None:
        """The site's recorder has vanished or appeared."""
        if not up and self._began is None and self._heard:
            self._began = self.span.start if self.span else self._heard
        self._back = up

    def hear(self, message: Message) -> bool:
        """Take a message that the bus has delivered; returns whether it is new."""
        t_ns = message_time(message)
        if isinstance(message, Health) and message.source == SITE:
            # Messages of other topics may come late, out of a ring.
            self._heard = max(self._heard, t_ns)
            self._end_at(t_ns)
        return self._remember(message, t_ns)

    def _end_at(self, t_ns: int) -> None:
        """The site is heard again: the outage has ended."""
        if self._began is not None and self._back and t_ns > self._began:
            self.span = Hole(self._began - MARGIN_NS, t_ns + MARGIN_NS)
            self._began = None

    def know(self, message: Message) -> None:
        """A message that an earlier run has recorded."""
        self._remember(message, message_time(message))

    def gap(self, gap: Gap) -> list[Gap]:
        """Take a gap of a numbered topic; returns it unless an outage explains it."""
        if self.span is None and self._began is None:
            if self._last is None or self._heard > self._last.end + LATE_NS:
                return [gap]
            self.span = self._last
        self._gaps.append(gap)
        return []

    def fill(self, parts: Iterable[Part]) -> list[Message]:
        """The messages of a recording that were missed."""
        found = [decode(line.message, data) for line, data in parts]
        fresh = [message for message in found if self._remember(message, message_time(message))]
        self.filled += len(fresh)
        return fresh

    def end(self, *, answered: bool) -> list[Gap]:
        """The answer has ended; returns the gaps that remain."""
        gaps, self._gaps = self._gaps, []
        self._last, self.span = self.span, None
        return [] if answered else gaps

    def rest(self) -> list[Gap]:
        """The gaps of an outage that has not been answered."""
        return self.end(answered=False)

    def _remember(self, message: Message, t_ns: int) -> bool:
        """Whether the message is new."""
        mark = hashlib.blake2b(encode(message), digest_size=16).digest()
        if mark in self._known:
            return False
        self._known.add(mark)
        self._order.append((t_ns, mark))
        if self.span is None and self._began is None:
            self._forget(self._heard - KNOWN_NS)
        return True

    def _forget(self, before: int) -> None:
        while self._order and self._order[0][0] < before:
            self._known.discard(self._order.popleft()[1])
