"""Shares the rate of the answers evenly among the recorders that ask for pages.

The time that its pages took is added up for each asker. An asker that has been served more than one
that waits is refused until they are even; it asks again by itself, so nobody has to be woken. One
that stops asking soon no longer counts as waiting, and a new one starts even with the least served.
Receives the time and reads no clock.
"""

from dataclasses import dataclass

WAITS = 1.0
"""Time for which an asker counts as waiting after a refusal: several of its attempts [s]."""
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
        """An admitted asker could not be served after all, as the server is ahead of its rate."""
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
