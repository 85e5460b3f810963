"""Whether a process that passes no samples on only waits for a processor.

Where every core is busy, a process that begins with hundreds of rigs, or behind others, may pass
nothing on for long. To start it anew would cost it what it has done, and more time. Linux counts
how long threads that could run have waited for a core (`schedstat`).
"""

from contextlib import suppress
from pathlib import Path

LOOK = 1.0
"""Time over which waiting is measured [s]."""
WAITED = 0.5
"""Share of that time, of all threads together, which a process that lacks time waits at least."""


class ProcessorWait:
    """One process that passes no samples on.

    Args:
        pid: of the process.
        now: monotonic time [s].

    Attributes:
        since: when the first look at it was taken [s].
        lacks: whether it lacked processor time in the last look; None before that is known.
    """

    def __init__(self, pid: int, now: float) -> None:
        self.since = self._looked_at = now
        self.lacks: bool | None = None
        self._pid, self._waited = pid, waited(pid)

    def look(self, now: float) -> None:
        """Measure on, if the time of a look is over."""
        if now - self._looked_at < LOOK:
            return
        total = waited(self._pid)
        self.lacks = total - self._waited > WAITED * (now - self._looked_at)
        self._looked_at, self._waited = now, total


def waited(pid: int) -> float:
    """How long the threads of a process that could run have waited for a core [s]; 0 if unknown."""
    total = 0
    with suppress(OSError):
        for thread in Path(f"/proc/{pid}/task").iterdir():
            with suppress(OSError, ValueError, IndexError):  # it has ended
                total += int((thread / "schedstat").read_text().split()[1])
    return total / 1e9
