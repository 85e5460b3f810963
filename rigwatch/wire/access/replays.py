"""Refuses a command that was executed before, in bounded memory."""

import heapq

KEPT = 1024
"""Number of nonces stored per certificate."""


class Replays:
    """The nonces of one certificate's commands in one run.

    When more than `KEPT` are stored, those with the earliest time of signing are dropped, and
    commands signed no later than a dropped one are refused.
    """

    def __init__(self) -> None:
        self._nonces: set[str] = set()
        self._by_time: list[tuple[int, str]] = []
        self._dropped_ns = -(1 << 63)

    def is_new(self, nonce: str, t_ns: int) -> bool:
        """Whether the command was not seen before; it is stored as seen.

        Args:
            nonce: of the command.
            t_ns: time of signing [ns].
        """
        if nonce in self._nonces or t_ns <= self._dropped_ns:
            return False
        self._nonces.add(nonce)
        heapq.heappush(self._by_time, (t_ns, nonce))
        if len(self._by_time) > KEPT:
            self._dropped_ns, dropped = heapq.heappop(self._by_time)
            self._nonces.discard(dropped)
        return True
