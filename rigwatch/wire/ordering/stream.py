"""The samples of one boot as they arrive, kept until their turn."""

from heapq import heappop, heappush
from typing import Generic

from rigwatch.wire.messages import cut, unseen
from rigwatch.wire.ordering.numbered import Numbered
from rigwatch.wire.ordering.ring_protocol import OPEN, S


class Stream(Generic[S]):
    """The samples of one boot: the next number, and blocks waiting for earlier ones.

    Attributes:
        next: number of the next sample.
        promised_from: a missing sample before this one is not a loss, as it was optional.
        ended: another boot has control; only the end of this one is still queried.
    """

    def __init__(self, boot: int, next_seq: int, promised_from: int = 0) -> None:
        self.boot = boot
        self.next = next_seq
        self.promised_from = promised_from
        self.ended = False
        self.waiting: dict[int, S] = {}
        self.samples_waiting = 0
        # A search among all that waits, for each block that comes, keeps a reader that is behind
        # from ever catching up.
        self._numbers: list[int] = []

    def hold(self, block: S) -> None:
        """Store a block until its turn; of two with the same start the longer."""
        known = self.waiting.get(block.seq)
        if known is None or len(known) < len(block):
            self.samples_waiting += len(block) - (len(known) if known else 0)
            self.waiting[block.seq] = block
            if known is None:
                heappush(self._numbers, block.seq)

    def first_waiting(self) -> int:
        """The lowest number among the waiting blocks; OPEN if there are none."""
        return self._numbers[0] if self._numbers else OPEN

    def take(self) -> S:
        """Remove and return the waiting block with the lowest number."""
        block = self.waiting.pop(heappop(self._numbers))
        self.samples_waiting -= len(block)
        return block

    def drop_waiting(self) -> None:
        """Forget all that waits."""
        self.waiting.clear()
        self._numbers.clear()
        self.samples_waiting = 0


def from_number(block: S, next_seq: int) -> S | None:
    """The part of a block from `next_seq` on, None if there is none."""
    if isinstance(block, Numbered):
        return block if block.seq >= next_seq else None
    return unseen(block, next_seq)


def up_to_number(block: S, last: int) -> S:
    """The part of a block up to `last`, which is not before its first sample."""
    if isinstance(block, Numbered):
        return block
    return cut(block, 0, min(len(block), last + 1 - block.seq))
