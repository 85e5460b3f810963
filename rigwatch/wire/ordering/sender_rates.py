"""How much each client may send to one reader of a topic whose messages are few.

Every client of a bus may publish events, gaps and health. One that sends them without end would
fill the recording, and retention would remove what is real for it. Each client has an account of
bytes that fills at a steady rate; a message that it does not cover is refused.
"""

RATE, BURST = 64_000.0, 4_000_000.0
"""Steady rate [bytes/s], and what an account holds at most [bytes]. A line that loses every second
sample needs a third of the rate, the gaps of a ring that comes back with as many a part of a burst.
"""
OVERHEAD = 200.0
"""What any message costs besides its bytes."""
MOST_SENDERS = 32
"""Clients with an account of their own; the others share one, as identities cost nothing."""


class SenderRates:
    """The accounts of the clients that one reader hears; reads no clock.

    Attributes:
        refused: messages refused.
    """

    def __init__(self) -> None:
        self.refused = 0
        self._accounts: dict[str, tuple[float, float]] = {}

    def admits(self, sender: str, size: int, now: float) -> bool:
        """Whether a message of `size` bytes that comes at `now` [s, monotonic] is covered."""
        if sender not in self._accounts and len(self._accounts) >= MOST_SENDERS:
            self._forget_full(now)
        if sender not in self._accounts and len(self._accounts) >= MOST_SENDERS:
            sender = ""
        left, at = self._accounts.get(sender, (BURST, now))
        left = min(BURST, left + RATE * (now - at)) - size - OVERHEAD
        if left < 0.0:
            self.refused += 1
            return False
        self._accounts[sender] = left, now
        return True

    def _forget_full(self, now: float) -> None:
        """Forget clients that have been silent for long enough."""
        for sender, (left, at) in tuple(self._accounts.items()):
            if left + RATE * (now - at) >= BURST:
                del self._accounts[sender]
