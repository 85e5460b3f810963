"""How long no estimate has come, as far as this process can know.

A witness that was not given its turn, on a busy core or in a virtual machine whose host paused it,
has not heard what was said meanwhile, and what waits reaches it after its next turn. So the first
such pause of a silence does not count; a second one does, or a witness that is always slow would
never tell.
"""

LATE = 0.3
"""Time between two turns above which this process was held up [s]; three turns."""


class Silence:
    """The time since the last estimate; receives the time and reads no clock.

    Args:
        heard_at: monotonic time from which silence counts [s].
    """

    def __init__(self, heard_at: float) -> None:
        self._heard_at = heard_at
        self._turned_at: float | None = None
        self._excused = 0.0

    def end(self, now: float) -> None:
        """An estimate has come."""
        self._heard_at, self._excused = now, 0.0

    def age(self, now: float) -> float:
        """Time since the last estimate [s]."""
        return max(0.0, now - self._heard_at)

    def counted(self, now: float) -> float:
        """The part of it that counts at this turn [s]."""
        before, self._turned_at = self._turned_at, now
        if before is not None and not self._excused:
            held_up = now - max(before, self._heard_at)
            self._excused = held_up if held_up > LATE else 0.0
        return self.age(now) - self._excused
