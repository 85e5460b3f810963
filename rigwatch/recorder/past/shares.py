"""Whose turn it is: recorders that ask for pages share the rate of the answers evenly.

Each asker has a clock of the time that its pages took. One that is ahead of another that waits is
refused until that one has been served as much; refused ones ask again, so none is woken. An asker
that stops asking no longer waits after a moment, and one that begins starts level with the rest.
Pure: it receives the time.
"""

from dataclasses import dataclass

WAITS = 1.0
"""Time for which one that was refused counts as waiting: several of its attempts [s]."""
MOST_ASKERS = 16
"""Askers told apart; further ones count as one, since a name costs a stranger nothing."""


@dataclass
class _Asker:
    served: float
    seen: float
    waits: bool = False


class Shares:
    """The askers of one server."""

    def __init__(self) -> None:
        self._askers: dict[str, _Asker] = {}

    def admits(self, name: str, now: float) -> bool:
        """Whether an asker may be served now; otherwise it waits.

        Args:
            name: of the asker.
            now: monotonic time [s].
        """
        one = self._known(name, now)
        one.seen = now
        others = (other for other in self._askers.values() if other is not one and other.waits)
        one.waits = any(other.served < one.served for other in others)
        return not one.waits

    def refused(self, name: str, now: float) -> None:
        """An asker that was admitted could not be served: the server is ahead of its rate."""
        self._known(name, now).waits = True

    def served(self, name: str, cost: float, now: float) -> None:
        """A page of this cost [s] was served."""
        self._known(name, now).served += cost

    def _known(self, name: str, now: float) -> _Asker:
        self._askers = {n: one for n, one in self._askers.items() if now - one.seen <= WAITS}
        if name not in self._askers and len(self._askers) >= MOST_ASKERS:
            name = ""
        if name not in self._askers:
            level = min((one.served for one in self._askers.values()), default=0.0)
            self._askers[name] = _Asker(level, now)
        return self._askers[name]
