"""An alarm that comes and goes again and again is one alarm with a count (ISA-18.2: chattering).

From the fifth time within a minute on, the alarm keeps standing while its condition comes and goes,
and is published again only when the count has doubled. Once the condition has neither come nor gone
for a minute, the alarm follows it again.
"""

from collections import deque

WINDOW_NS = 60 * 1_000_000_000
MOST_IN_WINDOW = 4


class FlapWatch:
    """Counts how often one alarm comes; it looks at time stamps only, never at a clock.

    Attributes:
        holding: the alarm stands whether or not its condition holds.
        count: how often it has come since the first of the series.
    """

    def __init__(self) -> None:
        self.holding = False
        self.count = 0
        self._risen: deque[int] = deque(maxlen=MOST_IN_WINDOW + 1)
        self._changed_ns = 0
        self._told = 0

    @property
    def ends_ns(self) -> int | None:
        """When the series ends if nothing changes [ns]; None if there is none."""
        return self._changed_ns + WINDOW_NS if self.holding else None

    def came(self, t_ns: int) -> bool:
        """The condition has come; whether the alarm stood already, as part of a series."""
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
        """The condition has gone; whether the alarm stands all the same."""
        self._changed_ns = t_ns
        return self.holding

    def is_news(self) -> bool:
        """Whether the count is worth publishing: it has doubled."""
        if self.count < 2 * self._told:
            return False
        self._told = self.count
        return True

    def end(self) -> None:
        """The series is over."""
        self.holding, self.count, self._told = False, 0, 0
        self._risen.clear()
