"""Messages that arrive before the name of their sender's token is known."""

from collections import Counter, deque

from rigwatch.wire.ordering import Numbered

MOST_EARLY = 256


class EarlyMessages:
    """Keeps messages of unknown runs for as long as a token is there whose name is not known.

    Attributes:
        ended: the process whose token has just vanished before its name was known, "" for none.
    """

    def __init__(self) -> None:
        self.ended = ""
        self._unnamed: Counter[str] = Counter()
        self._kept: deque[tuple[Numbered, str]] = deque()

    def token(self, process: str, *, named: bool, alive: bool) -> None:
        """A token of a process has appeared, been named, or vanished without a name."""
        if not named and alive:
            self._unnamed[process] += 1
        elif self._unnamed[process]:
            self._unnamed[process] -= 1
        if not (named or alive):
            self.ended = process

    @property
    def expects(self) -> bool:
        """Whether a name is still to come."""
        return any(self._unnamed.values())

    def keep(self, message: Numbered, sender: str) -> bool:
        """Keep a message; False if no name is to come, or too many wait."""
        if not self.expects or len(self._kept) >= MOST_EARLY:
            return False
        self._kept.append((message, sender))
        return True

    def first_of(self, run: int) -> int | None:
        """Number of the first kept message of a run; None without one."""
        return min((one.seq for one, _ in self._kept if one.boot == run), default=None)

    def taken(self) -> list[tuple[Numbered, str]]:
        """The messages kept so far, which may be given back."""
        found, self._kept = [*self._kept], deque()
        return found

    def settle(self) -> None:
        """What could belong to an ended process has been looked at."""
        if not self.expects:
            self.ended = ""
