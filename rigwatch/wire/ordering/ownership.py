"""Who may send the samples of a boot: the process whose token for it was there first.

A boot's number is no secret, so that samples with it prove nothing. The token of a source names the
process that put it up, and the bus says with each message from which process it came. Once a boot
has an owner it keeps him until his token is gone, whoever else puts up a token for it.
"""


class Owners:
    """The owner of each boot, told of tokens as they come and go."""

    def __init__(self) -> None:
        self._tokens: dict[tuple[int, int], str] = {}
        self._owners: dict[int, tuple[int | None, str]] = {}

    def appeared(self, boot: int, since_ns: int, sender: str) -> None:
        """The token of `sender` for a boot is there, put up at `since_ns`."""
        self._tokens.setdefault((boot, since_ns), sender)

    def vanished(self, boot: int, since_ns: int) -> None:
        """That token is gone; the boot is free for the next."""
        self._tokens.pop((boot, since_ns), None)
        if boot in self._owners and self._owners[boot][0] == since_ns:
            del self._owners[boot]

    def admits(self, boot: int, sender: str) -> bool:
        """Whether samples of `boot` from `sender` are its owner's."""
        if self._owners.get(boot, (None, ""))[0] is None and (token := self._first(boot)):
            self._owners[boot] = token
        if boot not in self._owners:
            # No token yet: whoever speaks first, until a token says better.
            self._owners[boot] = (None, sender)
        return self._owners[boot][1] == sender

    def _first(self, boot: int) -> tuple[int, str] | None:
        """The oldest token of a boot: since when, and whose."""
        found = [(since, sender) for (b, since), sender in self._tokens.items() if b == boot]
        return min(found, default=None)
