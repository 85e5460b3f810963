"""Alarm floods after ISA-18.2 and EEMUA 191: more alarms in ten minutes than a person can follow.

A flood begins with the eleventh alarm within ten minutes and ends once fewer than five lie within
ten minutes.
"""

from collections import deque

WINDOW_NS = 600 * 1_000_000_000
MOST_IN_WINDOW = 10
FEWEST_TO_LAST = 5


class FloodWatch:
    """Counts raised alarms; it looks at their time stamps only, never at a clock."""

    def __init__(self) -> None:
        self.active = False
        self._raised: deque[int] = deque(maxlen=MOST_IN_WINDOW + 1)

    @property
    def count(self) -> int:
        """Alarms within the window, counted up to one more than a person can follow."""
        return len(self._raised)

    @property
    def ends_ns(self) -> int | None:
        """When the flood ends if no alarm follows [ns]; None where there is no flood."""
        if not self.active:
            return None
        return self._raised[-FEWEST_TO_LAST] + WINDOW_NS

    def add(self, t_ns: int) -> bool:
        """Count an alarm raised at `t_ns` [ns]; True if it begins a flood."""
        while self._raised and self._raised[0] + WINDOW_NS <= t_ns:
            self._raised.popleft()
        self._raised.append(t_ns)
        begins = not self.active and len(self._raised) > MOST_IN_WINDOW
        self.active = self.active or begins
        return begins

    def end(self) -> None:
        """The flood is over."""
        self.active = False
