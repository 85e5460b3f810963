"""Whether another process is there: by its liveliness token, and by what it says.

A token also vanishes for a moment when the process's link to the router breaks and is made again,
which takes Zenoh some tenths of a second. So absence counts only once the process has had neither a
token nor a word for longer than that.
"""

GRACE = 0.7
"""Time without token and message after which a process is gone [s]: told within a second."""


class Presence:
    """Presence of one process; receives the time and reads no clock."""

    def __init__(self) -> None:
        self._token = False
        self._since = float("-inf")

    def token(self, now: float, *, alive: bool) -> None:
        """Its token has appeared or vanished, at monotonic time `now` [s]."""
        if self._token and not alive:
            self.heard(now)
        self._token = alive

    @property
    def has_token(self) -> bool:
        """Whether its token is there."""
        return self._token

    def heard(self, now: float) -> None:
        """A message of it came at monotonic time `now` [s]."""
        self._since = max(self._since, now)

    def holds(self, now: float) -> bool:
        """Whether the process is there at monotonic time `now` [s]."""
        return self._token or now - self._since < GRACE
