"""How far the work is, with an estimate of what remains."""

import time
from collections.abc import Callable

EVERY_S = 5.0
"""Shortest time between two lines [s]."""


class Progress:
    """Says how many units are done, at most once in five seconds.

    Args:
        total: number of units.
        say: called with a line for people.
    """

    def __init__(self, total: int, say: Callable[[str], None]) -> None:
        self._total, self._say = total, say
        self._done = self._failed = self._kept = 0
        self._began = self._last = time.monotonic()

    def kept(self, count: int) -> None:
        """Units whose results are known from an earlier run."""
        self._kept = count
        if count:
            self._say(f"{count} of {self._total} are done already")

    def add(self, *, failed: bool) -> None:
        """One more unit is done."""
        self._done += 1
        self._failed += failed
        now = time.monotonic()
        if now - self._last >= EVERY_S:
            self._last = now
            self._say(self._line(now - self._began))

    def _line(self, elapsed: float) -> str:
        rate = self._done / elapsed
        left = (self._total - self._kept - self._done) / rate
        failed = f", {self._failed} failed" if self._failed else ""
        done = self._kept + self._done
        return f"{done} of {self._total}{failed}, {rate:.3g} a second, {duration(left)} left"


def duration(seconds: float) -> str:
    """A time for people, such as "1 h 20 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes = round(whole / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"
