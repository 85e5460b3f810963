"""Ownership of a boot: only the process with the first token for it may send its samples.

A boot's number is not secret, so it does not authenticate samples. The token of a source names the
process that declared it, and the bus gives the sender of each message. A boot keeps its owner until
the owner's token is gone, even if other processes declare tokens for it. After that the owner's
last samples may still be on the way, and a stranger's are no better than before: until another
token is there, the boot is the last owner's.
"""

MOST_UNPROVED = 64
"""Boots without a token whose first sender is known: any sender can make up more of them."""
MOST_ENDED = 64
"""Boots whose last owner is known; what is on the way belongs to the latest of them."""


class Owners:
    """The owner of each boot, updated as tokens appear and vanish."""

    def __init__(self) -> None:
        self._tokens: dict[tuple[int, int], str] = {}
        self._owners: dict[int, tuple[int | None, str]] = {}
        self._ended: dict[int, str] = {}

    def appeared(self, boot: int, since_ns: int, sender: str) -> None:
        """The token of `sender` for a boot has appeared, declared at `since_ns`."""
        self._tokens.setdefault((boot, since_ns), sender)

    def vanished(self, boot: int, since_ns: int) -> None:
        """That token has vanished; the boot is free for the next owner."""
        owner = self._owner(boot)
        self._tokens.pop((boot, since_ns), None)
        if owner is not None and owner[0] == since_ns:
            self._owners.pop(boot, None)
            self._remember(boot, owner[1])

    def admits(self, boot: int, sender: str) -> bool:
        """Whether samples of `boot` from `sender` are its owner's."""
        owner = self._owner(boot)
        if owner is None and boot in self._ended:
            return self._ended[boot] == sender
        if owner is None:
            # No token yet: the first sender, until a token shows the owner.
            self._make_room()
            owner = None, sender
        self._owners[boot] = owner
        return owner[1] == sender

    def owner_of(self, boot: int) -> str:
        """The owner of a boot, or its last one; "" if none is known."""
        owner = self._owner(boot)
        return self._ended.get(boot, "") if owner is None else owner[1]

    def _owner(self, boot: int) -> tuple[int | None, str] | None:
        """Start of the owner's token, None without one, and the owner; None if there is none."""
        owner = self._owners.get(boot)
        if owner is None or owner[0] is None:
            return self._first(boot) or owner
        return owner

    def _remember(self, boot: int, owner: str) -> None:
        self._ended.pop(boot, None)
        self._ended[boot] = owner
        if len(self._ended) > MOST_ENDED:
            del self._ended[next(iter(self._ended))]

    def _make_room(self) -> None:
        """Forget the oldest boot without a token if there are too many."""
        unproved = [boot for boot, (since, _) in self._owners.items() if since is None]
        if len(unproved) >= MOST_UNPROVED:
            del self._owners[unproved[0]]

    def _first(self, boot: int) -> tuple[int, str] | None:
        """The oldest token of a boot: its start and its owner."""
        found = [(since, sender) for (b, since), sender in self._tokens.items() if b == boot]
        return min(found, default=None)
