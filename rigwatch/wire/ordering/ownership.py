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
        self._ended: dict[int, tuple[int | None, str]] = {}
        self._heard: dict[int, tuple[int | None, str]] = {}
        self._passed: set[tuple[int, int]] = set()

    def appeared(self, boot: int, since_ns: int, sender: str) -> None:
        """The token of `sender` for a boot has appeared, declared at `since_ns`."""
        self._tokens.setdefault((boot, since_ns), sender)

    def vanished(self, boot: int, since_ns: int) -> None:
        """That token has vanished; the boot is free for the next owner."""
        owner = self._owner(boot)
        self._tokens.pop((boot, since_ns), None)
        self._passed.discard((boot, since_ns))
        if owner is not None and owner[0] == since_ns:
            self._owners.pop(boot, None)
            self._heard.pop(boot, None)
            self._remember(boot, owner)

    def admits(self, boot: int, sender: str) -> bool:
        """Whether samples of `boot` from `sender` are its owner's."""
        owner = self._owner(boot)
        if owner is None and boot in self._ended:
            return self._ended[boot][1] == sender
        if owner is None:
            # No token yet: the first sender, until a token shows the owner.
            self._make_room()
            owner = None, sender
        if owner[1] != sender:
            return False
        self._owners[boot] = owner
        if owner[0] is not None:
            self._heard[boot] = owner
        return True

    def is_doubtful(self, boot: int, sender: str) -> bool:
        """Whether `sender` has a token for a boot, of whose owner nothing was ever heard."""
        return self._heard.get(boot) != self._owner(boot) and any(
            one[0] == boot and one not in self._passed and holder == sender
            for one, holder in self._tokens.items()
        )

    def pass_over(self, boot: int) -> None:
        """Give the boot to the next token's process."""
        owner = self._owner(boot)
        if owner is not None and owner[0] is not None:
            self._passed.add((boot, owner[0]))
            self._owners.pop(boot, None)

    def is_contested(self, boot: int) -> bool:
        """Whether a process that was passed over still has its token for a boot."""
        return any(passed == boot for passed, _ in self._passed)

    def owner_of(self, boot: int) -> str:
        """The owner of a boot, or its last one; "" if none is known."""
        owner = self._owner(boot)
        return self._ended.get(boot, (None, ""))[1] if owner is None else owner[1]

    def _owner(self, boot: int) -> tuple[int | None, str] | None:
        """Start of the owner's token, None without one, and the owner; None if there is none."""
        owner = self._owners.get(boot)
        if owner is None or owner[0] is None:
            return self._first(boot) or owner
        return owner

    def _remember(self, boot: int, owner: tuple[int | None, str]) -> None:
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
        """The last owner's token of a boot, else the oldest one: its start and its owner."""
        found = [
            (one[1], sender)
            for one, sender in self._tokens.items()
            if one[0] == boot and one not in self._passed
        ]
        last = self._ended.get(boot)
        return min(found, key=lambda token: (token != last, token), default=None)
