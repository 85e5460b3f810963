"""Ownership of a boot: only the process with the first token for it may send its samples.

A boot's number is not secret, so it does not authenticate samples. The token of a source names the
process that declared it, and the bus gives the sender of each message. A boot keeps its owner until
the owner's token is gone, even if other processes declare tokens for it.
"""

MOST_UNPROVED = 64
"""Boots without a token whose first sender is known: any sender can make up more of them."""


class Owners:
    """The owner of each boot, updated as tokens appear and vanish."""

    def __init__(self) -> None:
        self._tokens: dict[tuple[int, int], str] = {}
        self._owners: dict[int, tuple[int | None, str]] = {}

    def appeared(self, boot: int, since_ns: int, sender: str) -> None:
        """The token of `sender` for a boot has appeared, declared at `since_ns`."""
        self._tokens.setdefault((boot, since_ns), sender)

    def vanished(self, boot: int, since_ns: int) -> None:
        """That token has vanished; the boot is free for the next owner."""
        self._tokens.pop((boot, since_ns), None)
        if boot in self._owners and self._owners[boot][0] == since_ns:
            del self._owners[boot]

    def admits(self, boot: int, sender: str) -> bool:
        """Whether samples of `boot` from `sender` are its owner's."""
        if self._owners.get(boot, (None, ""))[0] is None and (token := self._first(boot)):
            self._owners[boot] = token
        if boot not in self._owners:
            # No token yet: the first sender, until a token shows the owner.
            self._make_room()
            self._owners[boot] = (None, sender)
        return self._owners[boot][1] == sender

    def _make_room(self) -> None:
        """Forget the oldest boot without a token if there are too many."""
        unproved = [boot for boot, (since, _) in self._owners.items() if since is None]
        if len(unproved) >= MOST_UNPROVED:
            del self._owners[unproved[0]]

    def _first(self, boot: int) -> tuple[int, str] | None:
        """The oldest token of a boot: its start and its owner."""
        found = [(since, sender) for (b, since), sender in self._tokens.items() if b == boot]
        return min(found, default=None)
