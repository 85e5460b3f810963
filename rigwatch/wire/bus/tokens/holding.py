"""Holds a token with a name."""

import secrets

from rigwatch.wire.bus.tokens.names import said
from rigwatch.wire.bus.transport import Close, Transport

GROUPS, TURNS = 8, 4
SLOTS = GROUPS * TURNS
"""Keys of a place. A process takes a group that is free, and its turns for one name after another,
so that a token that appears is never mistaken for the one that has just vanished."""
ATTEMPTS = 5
"""Groups tried while another process takes the same one at the same moment."""
PATIENCE = 2.0
"""Longest wait for those that hold tokens there [s]: on a busy machine a group that is taken would
look free, and two tokens at one key are one to those that watch them."""


class NamedToken:
    """A token of this process, at one of the keys `<place>/<slot>`.

    Args:
        transport: declares it.
        place: complete key without the slot.
    """

    def __init__(self, transport: Transport, place: str) -> None:
        self._transport, self._place = transport, place
        self._group: int | None = None
        self._turn = 0
        self._withdraw: list[Close] = []

    def declare(self, name: str) -> None:
        """Declare the token as `<name>/<identity of this process>`, in place of an earlier one."""
        self.close()
        name = f"{name}/{self._transport.identity}"
        if self._group is None:
            self._take_group(name)
        else:
            self._answer(name)
        key = self._key()
        self._transport.put(key, said(key, name))
        self._withdraw.append(self._transport.declare_token(key))
        self._turn = (self._turn + 1) % TURNS

    def _take_group(self, name: str) -> None:
        for _ in range(ATTEMPTS):
            self.close()
            self._group = self._free_group()
            self._answer(name)
            found = self._transport.ask(self._key(), b"", PATIENCE)
            if all(answer == said(self._key(), name) for answer in found):
                return

    def _free_group(self) -> int:
        tokens = self._transport.tokens(f"{self._place}/*", PATIENCE)
        slots = [key.rpartition("/")[2] for key in tokens]
        taken = {int(slot) // TURNS for slot in slots if slot.isdecimal() and len(slot) < 4}
        free = [group for group in range(GROUPS) if group not in taken] or [*range(GROUPS)]
        return secrets.choice(free)

    def _answer(self, name: str) -> None:
        key = self._key()
        self._withdraw.append(self._transport.serve(key, lambda _: [said(key, name)]))

    def _key(self) -> str:
        return f"{self._place}/{(self._group or 0) * TURNS + self._turn}"

    def close(self) -> None:
        """Withdraw the token."""
        while self._withdraw:
            self._withdraw.pop()()
