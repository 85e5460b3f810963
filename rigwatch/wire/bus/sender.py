"""A subscriber's state for one sender of numbered messages: order, owners, live runs.

On the bus the end of a process's token may overtake what the process said just before. Messages of
a run that has ended are therefore taken for a while, from its owner only and in their order.
"""

import time

from rigwatch.wire.ordering import (
    Ask,
    Numbered,
    NumberedRun,
    Outcome,
    Owners,
    RingReply,
    SampleOrder,
)

MOST_WAITING = 16384
"""Messages that may wait behind a gap: minutes of estimates, which are most of them."""
LATE = 10.0
"""Time from the end of a run for which its messages are taken [s]: that of a silent link."""


class Sender:
    """One sending process and its runs.

    Args:
        resume_after: (run, number) of the last processed message; number -1 for none.
        patient: see `SampleOrder`.

    Attributes:
        order: determines which of its messages comes next.
    """

    def __init__(self, resume_after: tuple[int, int], *, patient: bool = False) -> None:
        self.order: SampleOrder[Numbered] = SampleOrder(
            resume_after, capacity=MOST_WAITING, patient=patient
        )
        self._owners = Owners()
        self._alive: dict[int, int] = {}
        self._ended: dict[int, float] = {}

    def appeared(self, run: int, since_ns: int, sender: str) -> list[Outcome[Numbered]]:
        """A run's token has appeared: messages sent during the interruption are also needed."""
        self._owners.appeared(run, since_ns, sender)
        self._alive[run] = since_ns
        self._ended.pop(run, None)
        return [
            *self.order.on_token(run, since_ns, True),
            *self._follow(),
            *self.order.on_silence(),
        ]

    def vanished(self, run: int, since_ns: int) -> list[Outcome[Numbered]]:
        """A run's token has vanished."""
        self._owners.vanished(run, since_ns)
        if self._alive.get(run) == since_ns:
            del self._alive[run]
            self._end(run)
        return [*self.order.on_token(run, since_ns, False), *self._follow()]

    def received(self, message: Numbered, sender: str) -> list[Outcome[Numbered]] | None:
        """Process a message; None if `sender` does not own its run, or it has ended long ago."""
        if not self._may_speak(message.boot) or not self._owners.admits(message.boot, sender):
            return None
        return self.order.on_block(message)

    def goes_on(self, run: NumberedRun, sender: str) -> bool:
        """Deliver messages that simply follow the last one, as nearly all do; else do nothing."""
        admitted = self._may_speak(run.boot) and self._owners.admits(run.boot, sender)
        return admitted and self.order.goes_on(run)

    @property
    def going_on(self) -> tuple[int, int, str] | None:
        """Run and number of the last message, and who sends the next one if it is delivered at
        once; otherwise None.
        """
        place = self.order.goes_on_after
        owner = "" if place is None else self._owners.owner_of(place[0])
        if place is None or not owner or not self._may_speak(place[0]):
            return None
        return (*place, owner) if self._owners.admits(place[0], owner) else None

    def went_on(self, count: int) -> None:
        """So many messages that follow have been delivered, where `going_on` says so."""
        self.order.went_on(count, Numbered.t_ns[0])

    def is_owner(self, sender: str) -> bool:
        """Whether `sender` owns a run that lives, or has just ended."""
        runs = [run for run in (*self._alive, *self._ended) if self._may_speak(run)]
        return any(self._owners.owner_of(run) == sender for run in runs)

    def replied(self, ask: Ask, reply: RingReply[Numbered] | None) -> list[Outcome[Numbered]]:
        """Process a ring's reply, None if there was none."""
        return self.order.on_reply(ask, reply)

    def silent(self) -> list[Outcome[Numbered]]:
        """Handle silence: lost messages at the end are not revealed by a successor."""
        return self.order.on_silence() if self._alive else []

    def _may_speak(self, run: int) -> bool:
        ended = self._ended.get(run)
        return run in self._alive or (ended is not None and time.monotonic() - ended < LATE)

    def _end(self, run: int) -> None:
        now = time.monotonic()
        self._ended = {one: at for one, at in self._ended.items() if now - at < LATE}
        self._ended[run] = now

    def _follow(self) -> list[Outcome[Numbered]]:
        """Follow a new run of the process from its first message on."""
        oldest = min(self._alive, key=lambda run: self._alive[run], default=None)
        return [] if oldest is None else self.order.follow(oldest)
