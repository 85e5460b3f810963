"""Whether more than one process calls itself the monitor of a rig.

Listeners believe the one that was there first, so with a stranger among them nobody can tell
whether the rig is watched. For a while there are two where a monitor starts anew: the router takes
the lease of a link to notice that the one before is gone.

Tokens that appear tell of most. One at the key of another does not appear; so all that hold one are
asked every now and then, in a thread, as one of them may not answer.
"""

import math
import threading

from rigwatch.wire.bus import SAID_KEY, Bus

_PLACE = f"{SAID_KEY}/monitor"

END_TIMEOUT = 2.0
"""Longest wait for the thread at the end [s]."""
RESTART = 5.0
"""Time beyond the lease in which a monitor that starts anew is alone again [s]."""


class Doubles:
    """Follows the processes that call themselves monitor.

    Args:
        bus: of the rig.
        patience: time for which there may be several [s].
    """

    def __init__(self, bus: Bus, patience: float) -> None:
        self._bus, self._patience = bus, patience
        self._names: set[str] = set()
        self._answered: set[str] = set()
        self._since: float | None = None
        self._asked_at = -math.inf
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._close = bus.watch_names(_PLACE, self._changed)

    def text(self, now: float) -> str:
        """What is wrong at a moment [s]; empty if there is one monitor, or none."""
        if now - self._asked_at >= RESTART and not self._looks():
            self._asked_at = now
            self._thread = threading.Thread(target=self._look, name="doubles", daemon=True)
            self._thread.start()
        with self._lock:
            count = len(self._names | self._answered)
        if count < 2:
            self._since = None
            return ""
        self._since = now if self._since is None else self._since
        if now - self._since < self._patience:
            return ""
        return f"{count} processes call themselves monitor, and listeners may hear the wrong one"

    def close(self) -> None:
        """Follow them no longer."""
        self._close()
        if self._thread is not None:
            self._thread.join(END_TIMEOUT)

    def _looks(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _look(self) -> None:
        """Ask who is there: a restart of the router may hide that a process has ended."""
        tokens, answered = self._bus.names(_PLACE), self._bus.holders(_PLACE)
        with self._lock:
            self._answered = answered
            if len(tokens) < 2:  # who is there but does not answer with a name counts, too
                self._names &= answered | {name for _, name in tokens if name}

    def _changed(self, _place: str, name: str | None, alive: bool) -> None:
        """In a thread of the bus: a process is there under a name, or gone."""
        if name is None:
            return
        with self._lock:
            (self._names.add if alive else self._names.discard)(name)
            if not alive:
                self._answered.discard(name)
