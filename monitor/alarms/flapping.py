"""Chattering alarms are combined into one alarm with a count (ISA-18.2).

From the fifth occurrence within a minute on, the alarm stays active while its condition comes and
goes, and is published again only when the count has doubled. After a minute without a change of the
condition, the alarm follows it again.
"""

from collections import deque

WINDOW_NS = 60 * 1_000_000_000
MOST_IN_WINDOW = 4


class FlapWatch:
    """Counts occurrences of one alarm by their time stamps; reads no clock.

    Attributes:
        holding: the alarm is kept active regardless of its condition.
        count: occurrences since the start of the series.
    """

    def __init__(self) -> None:
        self.holding = False
        self.count = 0
        self._risen: deque[int] = deque(maxlen=MOST_IN_WINDOW + 1)
        self._changed_ns = 0
        self._told = 0

    @property
    def ends_ns(self) -> int | None:
        """End of the series if nothing changes [ns]; None without a series."""
        return self._changed_ns + WINDOW_NS if self.holding else None

    def came(self, t_ns: int) -> bool:
        """The condition has become true; returns whether a series already held the alarm."""
        stood = self.holding
        if not stood and self._risen and self._risen[-1] + WINDOW_NS <= t_ns:
            self._risen.clear()
            self.count = 0
        self.count += 1
        self._changed_ns = t_ns
        self._risen.append(t_ns)
        full = len(self._risen) > MOST_IN_WINDOW
        if full and self._risen[0] + WINDOW_NS > t_ns and not stood:
            self.holding, self._told = True, self.count
        return stood

    def went(self, t_ns: int) -> bool:
        """The condition has become false; returns whether the alarm stays active."""
        self._changed_ns = t_ns
        return self.holding

    def is_news(self) -> bool:
        """Whether the count is to be published, as it has doubled."""
        if self.count < 2 * self._told:
            return False
        self._told = self.count
        return True

    def set_back(self, by_ns: int) -> None:
        """The clock of the time stamps has been set back [ns]."""
        self._changed_ns -= by_ns
        self._risen = deque((one - by_ns for one in self._risen), self._risen.maxlen)

    def end(self) -> None:
        """End the series."""
        self.holding, self.count, self._told = False, 0, 0
        self._risen.clear()
