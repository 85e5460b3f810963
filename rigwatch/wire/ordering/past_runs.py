"""Messages of the earlier runs of a process, for which its present run answers.

A subscriber that was cut off asks for the rest of the run that it knows. The answer to that also
names the run that came next, of which it may not have heard at all, until it has come to the
present one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rigwatch.wire.ordering.numbered import Numbered
from rigwatch.wire.ordering.ring_protocol import EMPTY, OPEN, UNKNOWN, Ask, RingReply

OVERHEAD = 64
"""Bytes of a reply for each message, besides its own."""


@dataclass(frozen=True, slots=True)
class PastRun:
    """A run that has ended.

    Attributes:
        run: its number.
        messages: those that are stored, in order.
        complete: whether the last of them is certainly the last that was sent.
    """

    run: int
    messages: tuple[Numbered, ...]
    complete: bool

    @property
    def newest(self) -> int:
        """Number of the last message; `EMPTY` if there is none."""
        return self.messages[-1].seq if self.messages else EMPTY


class PastRuns:
    """The earlier runs of one process, oldest first.

    Args:
        runs: in the order in which they began.
        reply_bytes: size of a reply [bytes].
    """

    def __init__(self, runs: Sequence[PastRun], reply_bytes: int) -> None:
        self._runs = tuple(runs)
        self._reply_bytes = reply_bytes

    def reply(self, ask: Ask) -> RingReply[Numbered]:
        """The requested messages, or after the last of them the run that came next."""
        known = next((one for one in self._runs if one.run == ask.boot), None)
        if known is None:
            return RingReply(ask.boot, UNKNOWN, ())
        later = (message for message in known.messages if message.seq >= ask.first)
        if found := first_fitting(later, ask.last, self._reply_bytes):
            return RingReply(ask.boot, found[-1].seq, found)
        if ask.last != OPEN:
            # Somebody has heard a later one, so these were sent and could not be stored.
            return RingReply(ask.boot, UNKNOWN, ())
        settled = known.newest if known.complete else UNKNOWN
        return RingReply(ask.boot, settled, self._after(known))

    def _after(self, run: PastRun) -> tuple[Numbered, ...]:
        """The name of the next run, as a message."""
        place = self._runs.index(run) + 1
        return tuple(Numbered(one.run, 0, b"") for one in self._runs[place : place + 1])


def first_fitting(
    messages: Iterable[Numbered], last: int, reply_bytes: int
) -> tuple[Numbered, ...]:
    """The first messages up to number `last`, as many as fit into one reply, at least one."""
    found: list[Numbered] = []
    size = 0
    for message in messages:
        size += len(message.payload) + OVERHEAD
        if message.seq > last or (found and size > reply_bytes):
            break
        found.append(message)
    return tuple(found)
