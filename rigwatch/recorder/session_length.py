"""When a session is as long as configured, so that the next one begins.

Archives index, thin and remove whole sessions: one that lasts as long as its rig runs would stay in
full for ever. The time is counted by the steady clock, whatever is done to the wall clock.
"""

DAY_S = 86_400.0


class SessionLength:
    """The length of the sessions of one recorder; reads no clock.

    Args:
        days: length of a session [days]; 0 for no limit.
        age_s: of the session that is recorded first, as the wall clock tells [s].
    """

    def __init__(self, days: float, age_s: float) -> None:
        self._length_s = days * DAY_S
        self._age_s = min(max(0.0, age_s), self._length_s)
        self._began: float | None = None

    def is_over(self, now: float) -> bool:
        """Whether a new session is to begin at `now` [s, monotonic]."""
        if self._began is None:
            self._began = now - self._age_s
        return self._length_s > 0.0 and now - self._began >= self._length_s

    def begin(self, now: float) -> None:
        """A new session has begun [s, monotonic]."""
        self._began = now
