"""Alarm floods after ISA-18.2 and EEMUA 191: more alarms in ten minutes than one can follow.

A flood begins with the eleventh alarm within ten minutes and ends when fewer than five remain
within ten minutes.
"""

from collections import deque

WINDOW_NS = 600 * 1_000_000_000
MOST_IN_WINDOW = 10
FEWEST_TO_LAST = 5


class FloodWatch:
    """Counts raised alarms by their time stamps; reads no clock."""

    def __init__(self) -> None:
        self.active = False
        self._raised: deque[int] = deque(maxlen=MOST_IN_WINDOW + 1)

    @property
    def count(self) -> int:
        """Number of alarms within the window, up to one more than an operator can follow."""
        return len(self._raised)

    @property
    def ends_ns(self) -> int | None:
        """End of the flood if no alarm follows [ns]; None without a flood."""
        if not self.active:
            return None
        return self._raised[-FEWEST_TO_LAST] + WINDOW_NS

    def add(self, t_ns: int) -> bool:
        """Count an alarm raised at `t_ns` [ns]; returns whether it begins a flood."""
        while self._raised and self._raised[0] + WINDOW_NS <= t_ns:
            self._raised.popleft()
        self._raised.append(t_ns)
        begins = not self.active and len(self._raised) > MOST_IN_WINDOW
        self.active = self.active or begins
        return begins

    def set_back(self, by_ns: int) -> None:
        """The clock of the time stamps has been set back [ns]."""
        self._raised = deque((one - by_ns for one in self._raised), self._raised.maxlen)

    def end(self) -> None:
        """End the flood."""
        self.active = False
