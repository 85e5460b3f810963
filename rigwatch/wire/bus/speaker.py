"""One process that says numbered messages, as a listener knows it: order, owners, runs alive."""

from rigwatch.wire.ordering import Ask, Numbered, Outcome, Owners, RingReply, SampleOrder


class Speaker:
    """One process and its runs.

    Args:
        resume_after: (run, number) of the last message that is dealt with; number -1 for none.

    Attributes:
        order: what of its messages comes next.
    """

    def __init__(self, resume_after: tuple[int, int]) -> None:
        self.order: SampleOrder[Numbered] = SampleOrder(resume_after)
        self._owners = Owners()
        self._alive: dict[int, int] = {}

    @property
    def alive(self) -> bool:
        """Whether any run of the process is there."""
        return bool(self._alive)

    def appeared(self, run: int, since_ns: int, sender: str) -> list[Outcome[Numbered]]:
        """The token of a run is there: also what was said while it was away is wanted."""
        self._owners.appeared(run, since_ns, sender)
        self._alive[run] = since_ns
        return [
            *self.order.on_token(run, since_ns, True),
            *self._follow(),
            *self.order.on_silence(),
        ]

    def vanished(self, run: int, since_ns: int) -> list[Outcome[Numbered]]:
        """That token is gone."""
        self._owners.vanished(run, since_ns)
        if self._alive.get(run) == since_ns:
            del self._alive[run]
        return [*self.order.on_token(run, since_ns, False), *self._follow()]

    def said(self, message: Numbered, sender: str) -> list[Outcome[Numbered]] | None:
        """What follows from a message; None where `sender` does not own its run."""
        if message.boot not in self._alive or not self._owners.admits(message.boot, sender):
            return None
        return self.order.on_block(message)

    def replied(self, ask: Ask, reply: RingReply[Numbered] | None) -> list[Outcome[Numbered]]:
        """What follows from a ring's reply, None where nobody replied."""
        return self.order.on_reply(ask, reply)

    def silent(self) -> list[Outcome[Numbered]]:
        """Nothing has come for a while: what was missed at the end has no successor to show it."""
        return self.order.on_silence() if self._alive else []

    def _follow(self) -> list[Outcome[Numbered]]:
        """A new run of the process is heard from its first message on."""
        oldest = min(self._alive, key=lambda run: self._alive[run], default=None)
        return [] if oldest is None else self.order.follow(oldest)
